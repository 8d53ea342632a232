-- The table: a slab whose top is the plane z = 0 of the world.

return softvt.asset {
  name = "table",
  shape = softvt.shape.box { size = { 1.2, 1.6, 0.05 } }:translate(0, 0, -0.025),
  body = softvt.static {},
  visuals = { { albedo = { 0.50, 0.36, 0.24 }, roughness = 0.55 } },
}
