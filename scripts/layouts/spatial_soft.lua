-- Two instances of the same soft object left and right of a plate. Left and right refer to the third-person image,
-- whose right is +y of the world. Both tasks of a mirrored pair use one layout, so they start from the same state.
local arrange = require "layouts.arrange"
local plate = require "assets.plate"
local scenery = require "scenery"
local table_top = require "assets.table"

local mm = 1e-3
-- Random ranges of position and yaw, in either direction.
local POSITION_RANGE, YAW_RANGE = 20 * mm, math.rad(30)

-- Positions of the left and right object and of the plate, x and y in mm. An open hand with its sensors needs 70 mm on
-- either side of the grasped object, the random range adds 20 mm, and the plate has a radius of 69 mm.
local PLACES = {
  { left = { -50, -190 }, right = { -50, 190 }, plate = { 40, 0 } },
  { left = { 10, -200 }, right = { 10, 200 }, plate = { -60, 0 } },
  { left = { -100, -185 }, right = { 0, 195 }, plate = { 20, 10 } },
  { left = { 0, -195 }, right = { -100, 185 }, plate = { 10, -10 } },
  { left = { -30, -205 }, right = { 40, 190 }, plate = { -20, -10 } },
}

local layouts = {}

-- Two instances of `asset` in the k-th arrangement.
function layouts.pair(asset, k)
  local places = PLACES[k] or error("layouts.pair: there are five arrangements, 1 to 5", 2)
  local recipe = require("assets." .. asset)
  return softvt.layout(asset .. "_pair", function(scene, rng)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "plate", asset = plate, at = { places.plate[1] * mm, places.plate[2] * mm } }
    for _, side in ipairs { "left", "right" } do
      local x, y = places[side][1] * mm, places[side][2] * mm
      local at = { x + rng:uniform(-POSITION_RANGE, POSITION_RANGE), y + rng:uniform(-POSITION_RANGE, POSITION_RANGE) }
      scene:add { name = side, asset = recipe, at = at, yaw = rng:uniform(-YAW_RANGE, YAW_RANGE) }
    end
    scenery.table_room(scene)
    arrange.arm(scene, rng)
  end)
end

return layouts
