-- A compact golden bun, 60 × 60 × 42 mm: a Kaiser roll, a glazed dome cut into a pinwheel of five curved leaves.
local material = require "materials"

local mm = 1e-3
local WIDTH, HEIGHT = 60 * mm, 42 * mm

local BELOW = 7 * mm
local function dome(deep)
  return softvt.shape
    .ellipsoid { size = { WIDTH - 2 * deep, WIDTH - 2 * deep, HEIGHT + BELOW - 2 * deep } }
    :translate(0, 0, (HEIGHT - BELOW) / 2)
end
local table_top = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:translate(0, 0, -0.01)

-- Cuts: narrow grooves that turn outwards in arcs and end above the fingers.
local CUT = 2.8 * mm
local cut = {
  axis = "z",
  count = 5,
  radial_pitch = 50 * mm,
  height = -CUT,
  sharpness = 2.6,
  mask = { axis = "z", from = 19 * mm, to = 30 * mm },
}
local pinwheel = dome(0):ridges(cut)

local crust = material.crust {
  base = { 0.74, 0.39, 0.075 },
  top = { 0.56, 0.22, 0.025 },
  browning = 0.7,
  foot = { 0.82, 0.58, 0.26 },
  sheen = 0.24,
  seed = 101,
}
table.insert(crust.layers, {
  mask = softvt.mask.inside { shape = dome(1.4 * mm), soft_m = 1.6 * mm },
  albedo = { 0.88, 0.70, 0.38 },
  roughness = 0.7,
  opacity = 0.9,
})

return softvt.asset {
  name = "golden_bun",
  shape = pinwheel:subtract(table_top, 4 * mm),
  body = softvt.soft {
    youngs_pa = 220e3,
    poisson = 0.36,
    density = 380,
    loss_factor = 0.20,
    collapse_strain = 0.10,
    damage_strain = 0.12,
  },
  hints = { grasp_height_m = 21 * mm },
  visuals = { crust },
}
