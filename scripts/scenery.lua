-- Visual surroundings of a scene, without collision.
local material = require "materials"
local mask = softvt.mask
local mm = 1e-3

local scenery = {}

local box = softvt.shape.box

local function seen(name, shape, look)
  return softvt.asset { name = name, shape = shape, body = softvt.scenery {}, visuals = { look } }
end

-- A board floor whose top is its origin; darker close below the shape `under`.
local function floor(under)
  local look = material.floorboards()
  if under then
    table.insert(look.layers, {
      mask = mask.inside { shape = under, soft_m = 0.9 },
      albedo = { 0.035, 0.028, 0.022 },
      roughness = 0.7,
      opacity = 0.8,
    })
  end
  return seen("floor", box { size = { 5, 5, 0.02 } }:translate(0, 0, -10 * mm), look)
end
local shaded_floor = floor(box { size = { 1.5, 1.5, 1 } }:translate(-0.85, 0, 0))

local groove = {
  mask = mask.stripes { axis = "y", pitch_m = 0.16, share = 0.05 },
  albedo = { 0.075, 0.095, 0.095 },
  roughness = 0.8,
  opacity = 0.9,
}
local wall = seen(
  "wall",
  box { size = { 0.04, 5, 3 } }:translate(-20 * mm, 0, 1.5),
  material.paint { base = { 0.235, 0.285, 0.275 }, layers = { groove }, seed = 31 }
)
local skirting = seen(
  "skirting",
  box { size = { 0.02, 5, 0.11 } }:translate(10 * mm, 0, 55 * mm),
  material.paint { base = { 0.62, 0.60, 0.55 }, seed = 33 }
)

-- Legs and apron of the table. The table top is an asset, because objects rest on it.
local LEG, HIGH = 0.07, 0.85
local legs
for _, x in ipairs { -0.53, 0.53 } do
  for _, y in ipairs { -0.73, 0.73 } do
    local leg = box { size = { LEG, LEG, HIGH } }:translate(x, y, HIGH / 2)
    legs = legs and legs:union(leg) or leg
  end
end
for _, side in ipairs { -1, 1 } do
  legs = legs
    :union(box { size = { 1.0, 0.025, 0.09 } }:translate(0, side * 0.73, HIGH - 0.045))
    :union(box { size = { 0.025, 1.4, 0.09 } }:translate(side * 0.53, 0, HIGH - 0.045))
end
local frame = seen("table_frame", legs, { albedo = { 0.29, 0.185, 0.105 }, roughness = 0.5 })

-- The robot's stand: a column between two plates; its top is 10 mm under the table's, as high as the robot's base
-- there.
local function stand(height)
  local shape = box { size = { 0.23, 0.26, 0.02 } }
    :translate(-0.056, 0, height - 10 * mm)
    :union(box { size = { 0.16, 0.16, height - 40 * mm } }:translate(-0.056, 0, height / 2))
    :union(box { size = { 0.36, 0.36, 0.02 } }:translate(-0.056, 0, 10 * mm))
  return seen("robot_stand", shape, { albedo = { 0.10, 0.105, 0.11 }, roughness = 0.42, metalness = 0.4 })
end

local function walls(scene, floor_z)
  scene:add { name = "wall", asset = wall, position = { -1.75, 0, floor_z } }
  scene:add { name = "skirting", asset = skirting, position = { -1.75, 0, floor_z } }
  scene:add { name = "side_wall", asset = wall, position = { 0.75, 2.5, floor_z }, yaw = -math.pi / 2 }
  scene:add { name = "side_skirting", asset = skirting, position = { 0.75, 2.5, floor_z }, yaw = -math.pi / 2 }
end

-- Walls for scenes supported by the floor, z = 0: walls behind the robot and on the side away from the light. The floor
-- itself is an asset, assets/floor.lua.
function scenery.floor_room(scene) walls(scene, 0) end

-- Walls for scenes supported by a table with its top at z = 0, with the robot on a stand next to it.
function scenery.table_room(scene)
  local floor_z = -HIGH - 0.05
  scene:add { name = "floor", asset = shaded_floor, position = { 0.75, 0, floor_z } }
  walls(scene, floor_z)
  scene:add { name = "table_frame", asset = frame, position = { 0, 0, floor_z } }
  local base = scene.base
  scene:add { name = "robot_stand", asset = stand(base[3] - floor_z), position = { base[1], base[2], floor_z } }
end

return scenery
