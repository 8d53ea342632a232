-- A soft toy cylinder, 53 mm across and 60 mm high: coral foam with rounded edges. It is placed upright.
local material = require "materials"

local mm = 1e-3
local RADIUS, HEIGHT, EDGE = 26.5 * mm, 60 * mm, 4 * mm

return softvt.asset {
  name = "cylinder",
  shape = softvt.shape
    .cylinder { radius = RADIUS - EDGE, height = HEIGHT - 2 * EDGE }
    :round(EDGE)
    :translate(0, 0, HEIGHT / 2),
  body = softvt.soft {
    youngs_pa = 50e3,
    poisson = 0.40,
    density = 200,
    loss_factor = 0.15,
    collapse_strain = 0.07,
    damage_strain = 0.50,
  },
  hints = { grasp_height_m = HEIGHT / 2 },
  visuals = { material.foam { base = { 0.72, 0.155, 0.085 }, seed = 141 } },
}
