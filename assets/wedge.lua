-- A soft toy wedge, 64 × 50 × 40 mm: a ramp of green foam with rounded edges. Its toe and its ridge are blunt, so that
-- no edge is thinner than the voxels can carry.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT, EDGE = 64 * mm, 50 * mm, 40 * mm, 3.5 * mm
local TOE, RIDGE = 9 * mm, 12 * mm

-- The section without the rounding, which adds its radius on every side.
local left, right = -LENGTH / 2 + EDGE, LENGTH / 2 - EDGE
local low, high = EDGE, HEIGHT - EDGE
local ramp = softvt.shape.prism {
  corners = { { left, low }, { right, low }, { right, TOE - EDGE }, { left + RIDGE - EDGE, high }, { left, high } },
  length = WIDTH - 2 * EDGE,
}

return softvt.asset {
  name = "wedge",
  shape = ramp:round(EDGE),
  body = softvt.soft {
    youngs_pa = 50e3,
    poisson = 0.40,
    density = 220,
    loss_factor = 0.15,
    collapse_strain = 0.07,
    damage_strain = 0.50,
  },
  hints = { grasp_height_m = 21.5 * mm, grasp_offset_m = -7 * mm },
  visuals = { material.foam { base = { 0.10, 0.42, 0.16 }, seed = 151 } },
}
