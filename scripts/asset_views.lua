-- Views of a single asset on the table: an image, and a simulation of the expert's grasp for its tactile images.
local grasp = require "experts.grasp"
local table_top = require "assets.table"

local views = {}

-- Vertical field of view of portraits, rad.
local FOVY = math.rad(28)

-- Edge lengths of an asset's bounding box, m.
function views.size(asset)
  local low, high = asset.shape:bounds()
  return { high[1] - low[1], high[2] - low[2], high[3] - low[3] }
end

-- An image of the asset, `edge` pixels wide and high. Its bounding sphere fills the image.
function views.portrait(asset, edge)
  local size = views.size(asset)
  local across = math.sqrt(size[1] ^ 2 + size[2] ^ 2 + size[3] ^ 2)
  local reach = 0.99 * across / 2 / math.sin(FOVY / 2)
  local layout = softvt.layout("portrait_" .. asset.name, function(scene)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "object", asset = asset, at = { 0.1, 0 }, yaw = math.rad(25) }
    local middle = { 0.1, 0, size[3] / 2 }
    scene:add_camera {
      name = "portrait",
      position = { 0.1 + reach * 0.71, -reach * 0.335, middle[3] + reach * 0.62 },
      look_at = middle,
      fovy = FOVY,
      width = edge,
      height = edge,
    }
  end)
  return softvt.simulate { layout = layout }:render { camera = "portrait" }
end

-- A simulation of the asset on the table, before the hand touches it.
function views.untouched(asset)
  local layout = softvt.layout("imprint_" .. asset.name, function(scene)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "object", asset = asset, at = { -0.05, 0 } }
  end)
  return softvt.simulate { layout = layout }
end

-- A simulation in which the hand has moved around the asset, and then did as `close` says.
local function grasped(asset, close)
  local sim = views.untouched(asset)
  local ok, why = sim:drive(function(arm, scene)
    local object = scene:object "object"
    local at = grasp.pose(object, grasp.height(object))
    if object.hints.grasp_rim_m then at = grasp.choose(scene, object, grasp.height(object)).pose end
    arm:move_to(at:translated { 0, 0, 0.08 }, { speed = 0.6, angular_speed = 3 })
    arm:move_to(at, { speed = 0.25 })
    close(arm, object)
    arm:wait(0.3)
  end)
  if not ok then error(asset.name .. ": " .. why) end
  return sim
end

-- A simulation of the asset in the expert's grasp, lifted by `lift` (m).
function views.held(asset, lift)
  return grasped(asset, function(arm, object)
    arm:grasp(grasp.closure(object), { rate = 0.6 })
    arm:wait(0.3)
    arm:move_by({ 0, 0, lift }, { speed = 0.2 })
  end)
end

-- A simulation of the asset on the table, pressed at a mean force per pad (N).
function views.pressed(asset, force)
  return grasped(asset, function(arm) arm:grasp(1, { rate = 0.04, force = force }) end)
end

return views
