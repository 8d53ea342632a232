-- Bounds of controllers that keep one number constant, by arithmetic: the share of the instances that a suite draws
-- whose safe window contains that number (experts.blind_grips). They do not bound controllers that find the grip by
-- trial. Nothing is simulated.
--
--   softvt scripts/blind_bounds.lua --suite object_hidden
--   softvt scripts/blind_bounds.lua --suite object_soft,object_varied --instances 500
local blind_grips = require "experts.blind_grips"
local grasp = require "experts.grasp"

local opt = softvt.options {
  suite = {
    default = { "object_varied", "spatial_varied", "object_hidden", "spatial_hidden" },
    help = "suites: files of suites/, without .lua",
  },
  page = { default = false, needs_out = true, help = "also write the tables, to bounds.md" },
  instances = { default = 1000, integer = true, min = 50, max = 20000, help = "instances per kind" },
}

local instances, kinds = {}, {}
for _, name in ipairs(opt.suite) do
  local suite = require("suites." .. name)
  if #suite > 0 then error(("--suite: suites/%s.lua returns a list of suites; name its members"):format(name), 0) end
  instances[name] = softvt.instances(suite)
  for _, kind in ipairs(instances[name]:kinds()) do
    if grasp.window { asset = kind } then kinds[#kinds + 1] = { suite = name, name = kind } end
  end
end
if #kinds == 0 then
  error("--suite: no goal object of these suites has a calibrated window; run softvt scripts/calibrate.lua first", 0)
end

-- A hand that feels: margin over the least force that holds the instance, and its relative error (1 sd).
local MARGIN, ERROR = 1.2, 0.07

-- Share of a sample that is safe with the margin over its least force, known with the error: the mean over quantiles of
-- the error.
local function felt(sample)
  -- Normal quantiles at (k - 0.5) / 10.
  local quantiles, inside = { -1.645, -1.036, -0.674, -0.385, -0.126, 0.126, 0.385, 0.674, 1.036, 1.645 }, 0
  for _, one in ipairs(sample) do
    local ratio = one.window.tight.force / one.window.loose.force
    for _, quantile in ipairs(quantiles) do
      local grip = MARGIN * math.exp(ERROR * quantile)
      if 1 <= grip and grip <= ratio then inside = inside + 1 end
    end
  end
  return inside / (#quantiles * #sample)
end

local function mean(sample, of)
  local sum = 0
  for _, one in ipairs(sample) do
    sum = sum + of(one)
  end
  return sum / #sample
end

local columns = { "suite", "kind" }
for _, name in ipairs(blind_grips.names) do
  columns[#columns + 1] = name
end
for _, name in ipairs { "felt", "kept_pct", "window_mm", "force_ratio" } do
  columns[#columns + 1] = name
end

local function measured(point)
  local name, kind = kinds[point.kind].suite, kinds[point.kind].name
  local own, kept = blind_grips.sample("fixed-closure", instances[name], kind, opt.instances)
  local row = { suite = name, kind = kind }
  for _, controller in ipairs(blind_grips.names) do
    -- The number is chosen on the controller's own sample, as in an episode.
    local best = blind_grips.best(controller, blind_grips.sample(controller, instances[name], kind))
    row[controller] = 100 * blind_grips.share(best, own)
  end
  row.felt, row.kept_pct = 100 * felt(own), 100 * kept
  row.window_mm = mean(own, function(one) return 1e3 * (one.window.loose.width - one.window.tight.width) end)
  row.force_ratio = mean(own, function(one) return one.window.tight.force / one.window.loose.force end)
  return row
end

-- Columns of the printed tables after their first, with formats.
local SHOWN = {}
for _, name in ipairs(blind_grips.names) do
  SHOWN[#SHOWN + 1] = { name, "%.0f" }
end
for _, column in ipairs { { "felt", "%.0f" }, { "kept_pct", "%.0f" }, { "window_mm", "%.2f" }, { "force_ratio", "%.2f" } } do
  SHOWN[#SHOWN + 1] = column
end

-- A Markdown table with `first` above its first column; rows are a name and the values of the columns.
local function table_of(first, rows)
  local header = { first }
  for _, column in ipairs(SHOWN) do
    header[#header + 1] = column[1]
  end
  local lines = { "| " .. table.concat(header, " | ") .. " |", "|" .. ("---|"):rep(#header) }
  for _, row in ipairs(rows) do
    local cells = { row.name }
    for _, column in ipairs(SHOWN) do
      cells[#cells + 1] = column[2]:format(row.values[column[1]])
    end
    lines[#lines + 1] = "| " .. table.concat(cells, " | ") .. " |"
  end
  return table.concat(lines, "\n") .. "\n"
end

local function means(rows)
  local all = {}
  for _, column in ipairs(SHOWN) do
    local sum = 0
    for _, row in ipairs(rows) do
      sum = sum + row.values[column[1]]
    end
    all[column[1]] = sum / #rows
  end
  return all
end

-- The means of all suites with the best controller of each, then one table per suite.
local function report(rows)
  local suites, kinds_of_suites, best = {}, {}, {}
  for _, name in ipairs(opt.suite) do
    local own = {}
    for _, row in ipairs(rows) do
      if row.suite == name then own[#own + 1] = { name = row.kind, values = row } end
    end
    local all, most = means(own), nil
    for _, controller in ipairs(blind_grips.names) do
      if not most or all[controller] > all[most] then most = controller end
    end
    suites[#suites + 1] = { name = name, values = all }
    best[#best + 1] = ("%s: %s, %.0f %%"):format(name, most, all[most])
    own[#own + 1] = { name = "mean", values = all }
    kinds_of_suites[#kinds_of_suites + 1] = table_of(name, own)
  end
  return table_of("suite", suites)
    .. "\nBest constant number: "
    .. table.concat(best, "; ")
    .. ".\n\n"
    .. table.concat(kinds_of_suites, "\n")
end

return softvt.experiment {
  name = "blind_bounds",
  options = opt,
  columns = columns,
  points = function()
    local list = {}
    for index = 1, #kinds do
      list[index] = { kind = index }
    end
    return list
  end,
  run = measured,
  finish = function(rows)
    local text = report(rows)
    return { text = text, files = opt.page and { ["bounds.md"] = text } or {} }
  end,
}
