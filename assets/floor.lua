-- A floor of boards that supports objects: its top is the plane z = 0 of the world. At x = 0.75, y = 0 it covers the
-- floor of scenery.floor_room board by board.
local material = require "materials"

return softvt.asset {
  name = "floor",
  shape = softvt.shape.box { size = { 5, 5, 0.05 } }:translate(0, 0, -0.025),
  body = softvt.static {},
  visuals = { material.floorboards() },
}
