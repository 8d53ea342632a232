-- A round sesame bun, 64 × 62 × 42 mm: an orange glazed dome with cream seeds strewn over its top.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 64 * mm, 62 * mm, 42 * mm

local SEED = 0.9 * mm
local BELOW = 6 * mm
local dome = softvt.shape
  .ellipsoid { size = { LENGTH, WIDTH, HEIGHT - SEED + BELOW } }
  :translate(0, 0, (HEIGHT - SEED - BELOW) / 2)
local table_top = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:translate(0, 0, -0.01)
local bun = dome:subtract(table_top, 4 * mm)

local seeded = bun:bumps {
  height = SEED,
  radius = 2 * mm,
  spacing = 6 * mm,
  seed = 3,
  mask = { axis = "z", from = 24 * mm, to = 30 * mm },
}

return softvt.asset {
  name = "sesame_bun",
  shape = seeded:paint { material = 1 }:paint { material = 0, region = bun:round(0.25 * mm) },
  body = softvt.soft {
    youngs_pa = 45e3,
    poisson = 0.34,
    density = 220,
    loss_factor = 0.20,
    collapse_strain = 0.10,
    damage_strain = 0.35,
  },
  hints = { grasp_height_m = 22 * mm },
  visuals = {
    material.crust {
      base = { 0.70, 0.27, 0.045 },
      top = { 0.50, 0.155, 0.022 },
      foot = { 0.80, 0.50, 0.20 },
      sheen = 0.26,
      seed = 51,
    },
    material.seeds { seed = 52 },
  },
}
