-- A soft toy ball, 57 mm: yellow silicone. It is drawn 3 % higher and cut off below by as much: on a foot 18 mm across
-- it does not roll.
local material = require "materials"

local mm = 1e-3
local SIZE, BELOW = 57 * mm, 1.6 * mm

local ball = softvt.shape.ellipsoid { size = { SIZE, SIZE, SIZE + BELOW } }:translate(0, 0, (SIZE - BELOW) / 2)
local table_top = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:translate(0, 0, -0.01)

return softvt.asset {
  name = "sphere",
  shape = ball:subtract(table_top, 2 * mm),
  body = softvt.soft {
    youngs_pa = 60e3,
    poisson = 0.40,
    density = 200,
    loss_factor = 0.10,
    collapse_strain = 0.10,
    damage_strain = 0.60,
  },
  hints = { grasp_height_m = SIZE / 2 },
  visuals = { material.silicone { base = { 0.86, 0.60, 0.05 }, seed = 171 } },
}
