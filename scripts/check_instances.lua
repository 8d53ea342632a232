-- Checks the limits and safe windows of instances. Presses a sample of the instances that the hidden variation draws,
-- and compares τ of the press with the one that their episodes are judged by. Then carries them with the robot's hand,
-- and compares the forces of the loosest and the tightest safe grip with the ends of their windows by the calibration.
--
--   softvt scripts/check_instances.lua                          every kind of the hidden suites
--   softvt scripts/check_instances.lua --asset cube --count 20
--
-- Also counts the draws that are kept. Writes docs/instance_checks.md if all kinds are checked.
local suite = require "suites.object_hidden"
local hidden = require "variations.hidden"
local carry = require "calibration.carry"
local grasp = require "experts.grasp"
local press = require "calibration.press"
local soft_asset = require "calibration.soft_asset"

-- Step of the press, m, and number of instances for the statistics of the draws.
local STEP, SAMPLE = 2.5e-4, 1000

local kinds = {}
for k, task in ipairs(suite.tasks) do
  kinds[k] = task.goal.object
end

local opt = softvt.options {
  asset = { default = kinds, help = "assets to check" },
  count = { default = 6, integer = true, min = 1, max = 1000, needs_out = true, help = "instances pressed per asset" },
}

local PAGE = [[
# Checks of the limits and windows of instances

The objects of the hidden suites differ from their assets in size, stiffness, density and stable strain, so each has a limit τ of its own. It is read
off the presses that the calibration stores (`src/evaluation/instance.rs`). `softvt scripts/check_instances.lua` draws instances as
the suites do, presses each in the simulation, and compares τ of that press with the one that episodes are judged by. An instance is kept if the
ratio of its largest to its smallest safe grip force, by the draw reference ([touch.md](touch.md#what-is-drawn)), is within the `window_ratio`
of `scripts/variations/hidden.lua`; the share of the draws that is kept is that of %d instances, and %d instances of each asset are pressed.

The same instances are then carried by the robot's hand, with the grasp and the motion of the expert, and the grip force per pad is bisected.
The loose end is the least force that carries the object with at most 2 mm of slip, the tight end the largest with which D stays within
τ. The last columns have both over those of the window by the calibration: the median, the smallest and the largest.

]]

local assets = {}
for _, name in ipairs(opt.asset) do
  assets[name] = soft_asset("check_instances", name, assets)
end

local function sample(name, count)
  return softvt.sample_instances { asset = assets[name], variation = hidden, suite = suite.name, count = count }
end

local function run(point, o)
  local one = sample(point.asset, point.index)[point.index]
  local change = {
    scale = one.scale,
    youngs_factor = one.youngs_factor,
    density_factor = one.density_factor,
    strain_factor = one.strain_factor,
  }
  local pressed = press.envelope(assets[point.asset], STEP, change)
  local window = grasp.window(one)
  local loose, tight = carry.ends(assets[point.asset], one, window, point.index)
  return {
    asset = point.asset,
    scale = one.scale,
    youngs_factor = one.youngs_factor,
    strain_factor = one.strain_factor,
    tau_pressed_pct = pressed.tau,
    tau_judged_pct = window.tau,
    censored = pressed.censored,
    error_pct = pressed.tau and 100 * (window.tau / pressed.tau - 1),
    loose_ratio = loose and loose / window.loose.force,
    tight_ratio = tight and tight / window.tight.force,
  }
end

-- Median and range of a column over the rows of one asset.
local function spread(name, rows, column)
  local values = {}
  for _, row in ipairs(rows) do
    if row.asset == name and row[column] then values[#values + 1] = row[column] end
  end
  table.sort(values)
  if #values == 0 then return "–" end
  local middle = (#values + 1) / 2
  return ("%.2f (%.2f–%.2f)"):format(
    0.5 * (values[math.floor(middle)] + values[math.ceil(middle)]),
    values[1],
    values[#values]
  )
end

-- Row of the page about one asset: the share of the draws that is kept, the largest error of τ, and the ends of the
-- windows.
local function summary(name, rows)
  local draws, worst, count = 0, 0, 0
  for _, one in ipairs(sample(name, SAMPLE)) do
    draws = draws + one.draws
  end
  for _, row in ipairs(rows) do
    if row.asset == name then
      count = count + 1
      -- A press that ends early has no τ to compare with.
      worst = math.max(worst, row.error_pct and math.abs(row.error_pct) or math.huge)
    end
  end
  local loose, tight = spread(name, rows, "loose_ratio"), spread(name, rows, "tight_ratio")
  return ("| %s | %.1f | %d | %.1f | %s | %s |"):format(name, 100 * SAMPLE / draws, count, worst, loose, tight)
end

local function finish(rows, o)
  local lines = {}
  for k, name in ipairs(o.asset) do
    lines[k] = summary(name, rows)
  end
  local header =
    "| asset | draws kept, % | instances | largest error of τ, % | loose end, carried / window | tight end, carried / window |\n|---|---|---|---|---|---|\n"
  local text = header .. table.concat(lines, "\n") .. "\n"
  if #o.asset < #kinds then return { text = text } end
  local page = PAGE:format(SAMPLE, o.count) .. text
  return { text = text, files = { ["docs/instance_checks.md"] = page } }
end

local function points(o)
  local list = {}
  for _, name in ipairs(o.asset) do
    for index = 1, o.count do
      list[#list + 1] = { asset = name, index = index }
    end
  end
  return list
end

return softvt.experiment {
  name = "check_instances",
  options = opt,
  points = points,
  run = run,
  finish = finish,
  columns = {
    "asset",
    "scale",
    "youngs_factor",
    "strain_factor",
    "tau_pressed_pct",
    "tau_judged_pct",
    "error_pct",
    "loose_ratio",
    "tight_ratio",
    "censored",
  },
}
