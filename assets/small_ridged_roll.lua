-- A small ridged bread roll, 62 × 44 × 34 mm: a dark brown oval with rounded ridges across.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 62 * mm, 44 * mm, 34 * mm

-- Ridges run around the long axis; they fade towards the flat base.
local RIDGE = 1.6 * mm
local BELOW = 4 * mm
local oval = softvt.shape
  .ellipsoid { size = { LENGTH, WIDTH - 2 * RIDGE, HEIGHT - RIDGE + BELOW } }
  :translate(0, 0, (HEIGHT - RIDGE - BELOW) / 2)
local ridged = oval:ridges {
  axis = "x",
  pitch = 9 * mm,
  height = RIDGE,
  mask = { axis = "z", from = 2 * mm, to = 9 * mm },
}
local table_top = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:translate(0, 0, -0.01)

return softvt.asset {
  name = "small_ridged_roll",
  shape = ridged:subtract(table_top, 3 * mm):paint { material = 1, region = oval:round(0.45 * mm) },
  -- It is 5.7 voxels wide; with the usual six along its length it would be 4.3.
  body = softvt.soft {
    youngs_pa = 110e3,
    poisson = 0.38,
    density = 320,
    loss_factor = 0.20,
    resolution = 8,
    collapse_strain = 0.12,
    damage_strain = 0.15,
  },
  hints = { grasp_height_m = 18.5 * mm },
  visuals = {
    material.floured(
      material.crust {
        base = { 0.075, 0.029, 0.012 },
        top = { 0.048, 0.018, 0.008 },
        foot = { 0.13, 0.058, 0.024 },
        sheen = 0.40,
        rise_m = 9 * mm,
        seed = 61,
      },
      { seed = 65, opacity = 0.40 }
    ),
    material.crust {
      base = { 0.17, 0.075, 0.030 },
      top = { 0.13, 0.055, 0.021 },
      foot = { 0.21, 0.10, 0.042 },
      sheen = 0.62,
      rise_m = 9 * mm,
      seed = 62,
    },
  },
}
