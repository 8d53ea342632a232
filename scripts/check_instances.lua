-- Checks the limits of instances: presses a sample of the instances that the hidden variation draws, and compares D_ref of the press with the
-- one that their episodes are judged by.
--
--   softvt scripts/check_instances.lua                          every kind of the hidden suites
--   softvt scripts/check_instances.lua --asset cube --count 20
--
-- Also counts the draws: an instance is kept if its largest safe grip force is 1.3 to 1.8 times its smallest. Writes docs/instance_checks.md
-- if all kinds are checked.
local suite = require "suites.object_hidden"
local hidden = require "variations.hidden"
local press = require "calibration.press"
local soft_asset = require "calibration.soft_asset"

-- Step of the press, m, and number of instances for the statistics of the draws.
local STEP, SAMPLE = 2.5e-4, 1000

local kinds = {}
for k, task in ipairs(suite.tasks) do kinds[k] = task.goal.object end

local opt = softvt.options {
  asset = { default = kinds, help = "assets to check" },
  count = { default = 6, integer = true, min = 1, max = 1000, needs_out = true, help = "instances pressed per asset" },
}

local PAGE = [[
# Checks of the limits of instances

The objects of the hidden suites differ from their assets in size, stiffness, density and stable strain, so each has a limit τ of its own. It is read
off the presses that the calibration stores (`src/evaluation/instance.rs`). `softvt scripts/check_instances.lua` draws instances as
the suites do, presses each in the simulation, and compares τ of that press with the one that episodes are judged by. An instance is kept if the
ratio of its largest to its smallest safe grip force is 1.3 to 1.8; the share of the draws that is kept is that of %d instances, and %d
instances of each asset are pressed.

]]

local assets = {}
for _, name in ipairs(opt.asset) do assets[name] = soft_asset("check_instances", name, assets) end

local function sample(name, count)
  return softvt.sample_instances { asset = assets[name], variation = hidden, suite = suite.name, count = count }
end

local function run(point, o)
  local one = sample(point.asset, point.index)[point.index]
  local change = {
    scale = one.scale, youngs_factor = one.youngs_factor, density_factor = one.density_factor, strain_factor = one.strain_factor,
  }
  local sweep = press.sweep(assets[point.asset], STEP, change)
  local pressed = softvt.envelope {
    asset = point.asset, stable_strain = sweep.stable_strain, ended = sweep.ended, sweep = sweep.rows, holds = {},
  }
  local window = softvt.grip_window {
    asset = point.asset, scale = one.scale, youngs_factor = one.youngs_factor, density_factor = one.density_factor,
    strain_factor = one.strain_factor, coating = one.coating,
  }
  return {
    asset = point.asset, scale = one.scale, youngs_factor = one.youngs_factor, strain_factor = one.strain_factor,
    tau_pressed_pct = pressed.tau, tau_judged_pct = window.tau, censored = pressed.censored,
    error_pct = pressed.tau and 100 * (window.tau / pressed.tau - 1),
  }
end

-- Row of the page about one asset: the share of the draws that is kept, the largest error of τ, and its kept instances.
local function summary(name, rows)
  local draws, worst, count = 0, 0, 0
  for _, one in ipairs(sample(name, SAMPLE)) do draws = draws + one.draws end
  for _, row in ipairs(rows) do
    if row.asset == name then
      count = count + 1
      -- A press that ends early has no τ to compare with.
      worst = math.max(worst, row.error_pct and math.abs(row.error_pct) or math.huge)
    end
  end
  return ("| %s | %.1f | %d | %.1f |"):format(name, 100 * SAMPLE / draws, count, worst)
end

local function finish(rows, o)
  local lines = {}
  for k, name in ipairs(o.asset) do lines[k] = summary(name, rows) end
  local header = "| asset | draws kept, % | instances pressed | largest error of τ, % |\n|---|---|---|---|\n"
  local text = header .. table.concat(lines, "\n") .. "\n"
  if #o.asset < #kinds then return { text = text } end
  local page = PAGE:format(SAMPLE, o.count) .. text
  return { text = text, files = { ["docs/instance_checks.md"] = page } }
end

local function points(o)
  local list = {}
  for _, name in ipairs(o.asset) do
    for index = 1, o.count do list[#list + 1] = { asset = name, index = index } end
  end
  return list
end

return softvt.experiment {
  name = "check_instances",
  options = opt,
  points = points,
  run = run,
  finish = finish,
  columns = { "asset", "scale", "youngs_factor", "strain_factor", "tau_pressed_pct", "tau_judged_pct", "error_pct", "censored" },
}
