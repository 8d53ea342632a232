-- Whether an asset stays where it is put: each alone on the table, settled, then watched for some seconds. One that rolls
-- away needs a flatter foot; scripts/contact_sheet.lua draws how it lies.
--
--   softvt scripts/rest.lua --asset my_pastry
local soft_assets = require("asset_names").soft
local table_top = require "assets.table"

local opt = softvt.options {
  asset = { default = soft_assets, help = "assets to watch" },
  wait_s = { default = 3, unit = "s", min = 0.1, max = 60, help = "how long each is watched" },
  yaw_deg = { default = 25, unit = "°", min = -180, max = 180, help = "how it is turned" },
}

-- Files are served from here on by name, so every asset is read when the plan is made.
local assets = {}
for _, name in ipairs(opt.asset) do assets[name] = require("assets." .. name) end

-- What may not be called rest: mm, degrees, m/s.
local MOVED_MM, TURNED_DEG, SPEED = 0.1, 0.5, 1e-3

local function alone(name)
  return softvt.layout("rest_" .. name, function(scene)
    scene:add { name = "table", asset = table_top, xyz = { 0, 0, 0 } }
    scene:add { name = "object", asset = assets[name], at = { 0.1, 0 }, yaw = math.rad(opt.yaw_deg) }
  end)
end

-- Where the object is now.
local function place(sim)
  local seen
  sim:drive(function(arm, scene)
    seen = scene:object "object"
    arm:wait(arm.dt)
  end)
  return seen
end

return softvt.experiment {
  name = "rest",
  columns = { "asset", "rests", "moved_mm", "sunk_mm", "turned_deg", "speed_m_s", "asleep" },
  grid = { asset = opt.asset },
  run = function(point)
    local sim = softvt.simulate { layout = alone(point.asset) }
    local before = place(sim)
    local ok, why = sim:wait(opt.wait_s)
    if not ok then error(point.asset .. ": " .. why) end
    local after, seen = place(sim), sim:watch "object"
    local moved = 1e3 * math.sqrt((after.xyz[1] - before.xyz[1]) ^ 2 + (after.xyz[2] - before.xyz[2]) ^ 2)
    local sunk = 1e3 * (before.xyz[3] - after.xyz[3])
    -- From the yaw that it was given: settling may turn it too.
    local turned = math.deg(after.yaw) - opt.yaw_deg
    return {
      asset = point.asset, moved_mm = moved, sunk_mm = sunk, turned_deg = turned, speed_m_s = seen.speed, asleep = seen.asleep,
      rests = moved < MOVED_MM and math.abs(sunk) < MOVED_MM and math.abs(turned) < TURNED_DEG and seen.speed < SPEED,
    }
  end,
}
