local ranges = { name = "test", size = { 0.9, 1.1 }, stiffness = { 1, 1 }, density = { 1, 1 }, friction = { 1, 1 }, colour = 0.1,
  light = { 1, 1 }, camera_offset = 0, camera_rotation = 0,
  hidden = { aeration = { 0.5, 2.5 }, staling = { 1, 6 }, filling = { 1, 4 }, coating = { 0.2, 1.5 }, window_ratio = { 1.5, 2.2 } } }
local sphere = require "assets.sphere"
local function placed(asset)
  return function(scene) for k, name in ipairs { "left", "right" } do scene:add { name = name, asset = asset, at = { 0.1 * k, 0 } } end end
end
