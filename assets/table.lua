-- The table: a slab whose top is the plane z = 0 of the world.
local material = require "materials"

return softvt.asset {
  name = "table",
  shape = softvt.shape.box { size = { 1.2, 1.6, 0.05 } }:translate(0, 0, -0.025),
  body = softvt.static {},
  visuals = { material.wood { seed = 91 } },
}
