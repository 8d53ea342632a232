-- Two kitchen tables: one with a cabinet, one with a stove, each with a plate and a few things to eat.
local arrange = require "layouts.arrange"
local scenery = require "scenery"
local cabinet, stove = require "assets.wooden_cabinet", require "assets.flat_stove"
local table_top = require "assets.table"

local mm = 1e-3
-- Random ranges of objects on the table, and of the yaw of objects on others, in either direction.
local POSITION_RANGE, YAW_RANGE, YAW_ON_TOP = 15 * mm, math.rad(20), math.rad(10)
-- Clearance between objects, m.
local CLEARANCE = 12 * mm

-- The cabinet's drawers open towards the middle of the table, and the stove's knob faces it.
local CABINET = {
  name = "cabinet",
  asset = cabinet,
  at = { 50 * mm, -300 * mm },
  yaw = math.rad(-150),
  position_range = 8 * mm,
  yaw_range = 0.03,
}
local STOVE = {
  name = "stove",
  asset = stove,
  at = { -300 * mm, -270 * mm },
  yaw = math.rad(135),
  position_range = 8 * mm,
  yaw_range = 0.03,
}

-- Distance from the origin beyond which no object of a scene lies, mm.
local FAR = 3000

-- Checks a list as layouts.cabinet takes it; errors are at the line that called the function `name` of this file.
local function check(name, objects)
  local function wrong(place, message) error(("layouts.%s: objects%s: %s"):format(name, place, message), 5) end
  local entry = '{ "bun", "golden_bun", -90, 230 }'
  if type(objects) ~= "table" then wrong("", ("expected a list of objects such as %s"):format(entry)) end
  for k, object in ipairs(objects) do
    local place = ("[%d]"):format(k)
    if type(object) ~= "table" then
      wrong(place, ("expected a table; the list has a table for each object: { %s }"):format(entry))
    end
    local types = { "string", "string", "number", "number", yaw = "number", on = "string" }
    for key, value in pairs(object) do
      if not types[key] then
        wrong(place, ("unknown key %s; an entry has name, asset, x and y (mm), yaw and on"):format(key))
      elseif type(value) ~= types[key] then
        local got = ("expected a %s, got %s; an entry is such as %s"):format(types[key], type(value), entry)
        wrong(("[%d].%s"):format(k, key), got)
      end
    end
    if #object ~= 4 then wrong(place, ("expected name, asset, x and y (mm) such as %s"):format(entry)) end
    local x, y = object[3], object[4]
    local most = math.max(math.abs(x), math.abs(y))
    -- On another object, places are small; residues of a computation are 0.
    if not object.on and most > 1e-3 and most < 1 then
      wrong(place, ("x and y are in mm, got %g, %g; did you mean %g, %g?"):format(x, y, x / mm, y / mm))
    end
    if most > FAR then wrong(place, ("%g, %g mm is out of the scene"):format(x, y)) end
  end
end

-- Objects on the table, and those on others, of a list as layouts.cabinet takes it.
local function sorted(objects)
  local on_table, on_others = {}, {}
  for _, object in ipairs(objects) do
    local name, asset, x, y = table.unpack(object)
    local list = object.on and on_others or on_table
    list[#list + 1] = {
      name = name,
      asset = require("assets." .. asset),
      at = { x * mm, y * mm },
      yaw = object.yaw or 0,
      position_range = not object.on and POSITION_RANGE or nil,
      yaw_range = not object.on and YAW_RANGE or nil,
      on = object.on,
    }
  end
  return on_table, on_others
end

-- Adds an object on top of another, which is at { x, y, yaw }.
local function add_on(scene, rng, object, under)
  local c, s = math.cos(under.yaw), math.sin(under.yaw)
  local x, y = table.unpack(object.at)
  scene:add {
    name = object.name,
    asset = object.asset,
    at = { under.x + c * x - s * y, under.y + s * x + c * y },
    on = object.on,
    yaw = math.fmod(under.yaw + object.yaw + rng:uniform(-YAW_ON_TOP, YAW_ON_TOP), 2 * math.pi),
  }
end

local layouts = {}

-- A table with a piece of furniture and objects.
local function layout(name, furniture, joints, objects)
  check(furniture.name, objects)
  local on_table, on_others = sorted(objects)
  table.insert(on_table, 1, furniture)
  return softvt.layout("household_" .. name, function(scene, rng)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    local placed = {}
    for k, place in ipairs(arrange.scatter(rng, on_table, CLEARANCE)) do
      local object = on_table[k]
      placed[object.name] = place
      scene:add {
        name = object.name,
        asset = object.asset,
        at = { place.x, place.y },
        yaw = math.fmod(place.yaw, 2 * math.pi),
        joints = object == furniture and joints or nil,
      }
    end
    for _, object in ipairs(on_others) do
      add_on(scene, rng, object, placed[object.on:match "^[^.]+"])
    end
    scenery.table_room(scene)
    arrange.arm(scene, rng)
  end)
end

-- A table with a cabinet, whose top drawer is open by `open` (m). `objects` is a list of { name, asset, x, y } (mm)
-- with the optional field yaw (rad). With the field `on`, such as "cabinet.top_drawer", an object rests on another; x,
-- y and yaw are then in the frame of that object.
function layouts.cabinet(name, open, objects)
  -- No tail call: the level of errors counts this function.
  local made = layout(name, CABINET, { top_drawer = open }, objects)
  return made
end

-- The same with a stove, whose knob is at `angle` (rad).
function layouts.stove(name, angle, objects)
  local made = layout(name, STOVE, { knob = angle }, objects)
  return made
end

return layouts
