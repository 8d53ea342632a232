-- Checks the limits of instances: presses a sample of the instances that the hidden variation draws, and compares D_ref of the press with the
-- one that their episodes are judged by.
--
--   softvt scripts/check_instances.lua                          every kind of the hidden suites
--   softvt scripts/check_instances.lua --asset cube --count 20
--
-- Also counts the draws: an instance is kept if its largest safe grip force is 1.5 to 2.2 times its smallest. Writes docs/instance_checks.md
-- if all kinds are checked.
local hidden = require "variations.hidden"
local press = require "calibration.press"
local soft_asset = require "calibration.soft_asset"

local KINDS = {
  "steamed_bun", "spiral_roll", "yellow_roll", "golden_bun", "sesame_bun", "small_ridged_roll", "cube", "cylinder", "sphere", "capsule",
}
-- Step of the press, m, and number of instances for the statistics of the draws.
local STEP, SAMPLE = 2.5e-4, 1000

local opt = softvt.options {
  asset = { default = KINDS, help = "assets to check" },
  count = { default = 6, integer = true, min = 1, max = 1000, needs_out = true, help = "instances pressed per asset" },
}

local assets = {}
for _, name in ipairs(opt.asset) do assets[name] = soft_asset("check_instances", name, assets) end

local function sample(name, count)
  return softvt.sample_instances { asset = assets[name], variation = hidden, suite = "object_hidden", count = count }
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
  columns = { "asset", "scale", "youngs_factor", "strain_factor", "tau_pressed_pct", "tau_judged_pct", "error_pct", "censored" },
}
