-- A soft toy cube, 56 mm an edge: blue foam with rounded edges.
local material = require "materials"

local mm = 1e-3
local SIZE, EDGE = 56 * mm, 4 * mm
local core = SIZE - 2 * EDGE

return softvt.asset {
  name = "cube",
  shape = softvt.shape.box { size = { core, core, core } }:round(EDGE):translate(0, 0, SIZE / 2),
  body = softvt.soft {
    youngs_pa = 40e3,
    poisson = 0.40,
    density = 200,
    loss_factor = 0.15,
    collapse_strain = 0.07,
    damage_strain = 0.50,
  },
  hints = { grasp_height_m = SIZE / 2 },
  visuals = { material.foam { base = { 0.075, 0.30, 0.62 }, seed = 131 } },
}
