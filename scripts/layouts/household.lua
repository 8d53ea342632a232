-- Two kitchen tables: one with a cabinet, one with a stove, each with a plate and a few things to eat.
local arrange = require "layouts.arrange"
local scenery = require "scenery"
local cabinet, stove = require "assets.wooden_cabinet", require "assets.flat_stove"
local table_top = require "assets.table"

local mm = 1e-3
-- Random ranges of furniture and of other objects, in either direction.
local FURNITURE = { position_range = 8 * mm, yaw_range = 0.03 }
local LOOSE = { position_range = 15 * mm, yaw_range = math.rad(20) }
local ON_TOP = math.rad(10)
-- Clearance between objects, m.
local CLEARANCE = 12 * mm

-- The cabinet's drawers open towards the middle of the table, and the stove's knob faces it.
local CABINET = { name = "cabinet", asset = cabinet, at = { 50 * mm, -300 * mm }, yaw = math.rad(-150) }
local STOVE = { name = "stove", asset = stove, at = { -300 * mm, -270 * mm }, yaw = math.rad(135) }

local layouts = {}

-- A table with a piece of furniture and `objects`, a list of { name, asset, x, y } (mm) with optional fields yaw (rad),
-- on (the name of an object before it, whose centre it gets) and range (`false`: it is not displaced).
local function layout(name, furniture, joints, objects)
  local scattered, stacked = { furniture }, {}
  furniture.position_range, furniture.yaw_range = FURNITURE.position_range, FURNITURE.yaw_range
  for _, object in ipairs(objects) do
    local asset = require("assets." .. object[2])
    if object.on then
      stacked[#stacked + 1] =
        { name = object[1], asset = asset, on = object.on, x = object[3], y = object[4], yaw = object.yaw }
    else
      scattered[#scattered + 1] = {
        name = object[1],
        asset = asset,
        at = { object[3] * mm, object[4] * mm },
        yaw = object.yaw,
        position_range = LOOSE.position_range,
        yaw_range = LOOSE.yaw_range,
      }
    end
  end
  return softvt.layout("household_" .. name, function(scene, rng)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    local placed = {}
    for k, place in ipairs(arrange.scatter(rng, scattered, CLEARANCE)) do
      local object = scattered[k]
      placed[object.name] = place
      scene:add {
        name = object.name,
        asset = object.asset,
        at = { place.x, place.y },
        yaw = math.fmod(place.yaw, 2 * math.pi),
        joints = object == furniture and joints or nil,
      }
    end
    for _, object in ipairs(stacked) do
      local under = placed[object.on:match "^[^.]+"]
      local c, s = math.cos(under.yaw), math.sin(under.yaw)
      local x, y = object.x * mm, object.y * mm
      scene:add {
        name = object.name,
        asset = object.asset,
        at = { under.x + c * x - s * y, under.y + s * x + c * y },
        on = object.on,
        yaw = math.fmod(under.yaw + (object.yaw or 0) + rng:uniform(-ON_TOP, ON_TOP), 2 * math.pi),
      }
    end
    scenery.table_room(scene)
    arrange.arm(scene, rng)
  end)
end

-- A table with a cabinet, whose top drawer is open by `open` (m).
function layouts.cabinet(name, open, objects) return layout(name, CABINET, { top_drawer = open }, objects) end

-- A table with a stove, whose knob is at `angle` (rad).
function layouts.stove(name, angle, objects) return layout(name, STOVE, { knob = angle }, objects) end

return layouts
