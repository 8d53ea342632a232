-- Checks that assets rest stably: each is settled alone on the table and observed for some seconds. An asset that rolls
-- needs a flatter base; scripts/contact_sheet.lua shows how it lies.
--
--   softvt scripts/rest_check.lua --asset my_pastry
local soft_assets = require("asset_names").soft
local table_top = require "assets.table"

local opt = softvt.options {
  asset = { default = soft_assets, help = "assets to check" },
  wait_s = { default = 3, unit = "s", min = 0.1, max = 60, help = "time of observation" },
  yaw_deg = { default = 25, unit = "°", min = -180, max = 180, help = "yaw of the asset" },
}

-- Episodes use only files that were read when the plan was made, so every asset is required here.
local assets = {}
for _, name in ipairs(opt.asset) do
  assets[name] = require("assets." .. name)
end

-- Limits of an asset at rest: mm, degrees, m/s.
local MOVED_MM, TURNED_DEG, SPEED = 0.1, 0.5, 1e-3

local function alone(name)
  return softvt.layout("rest_" .. name, function(scene)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "object", asset = assets[name], at = { 0.1, 0 }, yaw = math.rad(opt.yaw_deg) }
  end)
end

-- The current state of the object.
local function state(sim)
  local seen
  sim:drive(function(arm, scene)
    seen = scene:object "object"
    arm:wait(arm.dt)
  end)
  return seen
end

return softvt.experiment {
  name = "rest_check",
  columns = { "asset", "rests", "moved_mm", "sunk_mm", "turned_deg", "speed_m_s", "asleep" },
  grid = { asset = opt.asset },
  run = function(point)
    local sim = softvt.simulate { layout = alone(point.asset) }
    local before = state(sim)
    local ok, why = sim:wait(opt.wait_s)
    if not ok then error(point.asset .. ": " .. why) end
    local after, seen = state(sim), sim:measure "object"
    local moved = 1e3 * math.sqrt((after.centre[1] - before.centre[1]) ^ 2 + (after.centre[2] - before.centre[2]) ^ 2)
    local sunk = 1e3 * (before.centre[3] - after.centre[3])
    -- Relative to the initial yaw, because settling may rotate the object too.
    local turned = math.deg(after.yaw) - opt.yaw_deg
    return {
      asset = point.asset,
      moved_mm = moved,
      sunk_mm = sunk,
      turned_deg = turned,
      speed_m_s = seen.speed,
      asleep = seen.asleep,
      rests = moved < MOVED_MM and math.abs(sunk) < MOVED_MM and math.abs(turned) < TURNED_DEG and seen.speed < SPEED,
    }
  end,
}
