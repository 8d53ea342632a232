-- The table scene of Spatial-Rigid: two black bowls, a plate, a ramekin, a box of cookies, a cabinet and a stove. The
-- goal's bowl is in one of ten relations to them. Positions are those of LIBERO's spatial suite.
local arrange = require "layouts.arrange"
local scenery = require "scenery"

local bowl, plate, ramekin = require "assets.black_bowl", require "assets.plate", require "assets.ramekin"
local cookies, cabinet, stove = require "assets.cookies", require "assets.wooden_cabinet", require "assets.flat_stove"
local table_top = require "assets.table"

local mm = 1e-3
-- Half extent of LIBERO's regions; objects on top of others vary less, m.
local REGION, ON_TOP = 10 * mm, 4 * mm
-- Clearance between objects, m.
local CLEARANCE = 4 * mm

local OBJECTS = {
  { name = "plate", asset = plate, at = { 60 * mm, 200 * mm } },
  { name = "cookies", asset = cookies, at = { 70 * mm, 30 * mm } },
  { name = "ramekin", asset = ramekin, at = { -200 * mm, 200 * mm } },
  { name = "cabinet", asset = cabinet, at = { 30 * mm, -270 * mm }, yaw = 2.69, yaw_range = 0.03 },
  { name = "stove", asset = stove, at = { -410 * mm, -140 * mm }, yaw = math.pi / 2 },
}

-- Positions of a bowl: on the table, on another object, or in the open top drawer.
local PLACES = {
  between_plate_and_ramekin = { at = { -70 * mm, 205 * mm } },
  next_to_ramekin = { at = { -180 * mm, 325 * mm } },
  next_to_cookies = { at = { 130 * mm, -70 * mm } },
  next_to_plate = { at = { 0, 340 * mm } },
  table_center = { at = { -75 * mm, 0 } },
  -- The bowl's foot enters the ramekin; it rests 29.7 mm above the table.
  on_cookies = { on = "cookies" },
  on_ramekin = { on = "ramekin", rests = 30.5 * mm },
  on_cabinet = { on = "cabinet" },
  on_stove = { on = "stove" },
  in_drawer = { drawer = { 0, -168 * mm, 148 * mm } },
}

-- For each task, the positions of the goal's bowl and of the other bowl.
local RELATIONS = {
  { "between_plate_and_ramekin", "next_to_ramekin" },
  { "next_to_ramekin", "next_to_cookies" },
  { "table_center", "next_to_plate" },
  { "on_cookies", "on_cabinet" },
  { "in_drawer", "on_cabinet" },
  { "on_ramekin", "on_cookies" },
  { "next_to_cookies", "on_stove" },
  { "on_stove", "on_cabinet" },
  { "next_to_plate", "next_to_ramekin" },
  { "on_cabinet", "on_stove" },
}

-- Transforms a point from an object's frame to the world.
local function to_world(place, point)
  local c, s = math.cos(place.yaw), math.sin(place.yaw)
  return { place.x + c * point[1] - s * point[2], place.y + s * point[1] + c * point[2], point[3] }
end

local layouts = {}

-- The k-th of the ten relations. The goal's bowl is named "bowl", the other "other_bowl".
function layouts.relation(k)
  local relation = RELATIONS[k] or error("there are ten relations", 2)
  local objects = { table.unpack(OBJECTS) }
  local bowls = { bowl = PLACES[relation[1]], other_bowl = PLACES[relation[2]] }
  for _, name in ipairs { "bowl", "other_bowl" } do
    if bowls[name].at then objects[#objects + 1] = { name = name, asset = bowl, at = bowls[name].at } end
  end
  for _, object in ipairs(objects) do
    object.position_range = REGION
  end
  local open = relation[1] == "in_drawer" and 0.15 or 0

  return softvt.layout("table_" .. relation[1], function(scene, rng)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    local placed = {}
    for i, place in ipairs(arrange.scatter(rng, objects, CLEARANCE)) do
      local object = objects[i]
      placed[object.name] = place
      scene:add {
        name = object.name,
        asset = object.asset,
        at = { place.x, place.y },
        yaw = place.yaw,
        joints = object.name == "cabinet" and { top_drawer = open } or nil,
      }
    end
    for _, name in ipairs { "bowl", "other_bowl" } do
      local how, dx, dy = bowls[name], rng:uniform(-ON_TOP, ON_TOP), rng:uniform(-ON_TOP, ON_TOP)
      if how.on then
        local under = placed[how.on]
        if how.rests then
          scene:add { name = name, asset = bowl, position = { under.x, under.y, how.rests } }
        else
          scene:add { name = name, asset = bowl, at = { under.x + dx, under.y + dy }, on = how.on }
        end
      elseif how.drawer then
        local drawer = to_world(placed.cabinet, how.drawer)
        scene:add { name = name, asset = bowl, position = { drawer[1] + dx, drawer[2] + dy, drawer[3] } }
      end
    end
    scenery.table_room(scene)
    arrange.arm(scene, rng)
  end)
end

return layouts
