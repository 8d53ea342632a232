-- A curved layered pastry, 88 × 60 × 36 mm: a half-moon of puff pastry, its leaves showing as steps around the side,
-- the glazed top scored in arcs.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 88 * mm, 60 * mm, 36 * mm

-- An oval drum with a bay on one side, lying flat.
local EDGE, BELOW = 8 * mm, 1.5 * mm
local LEAF, SCORE = 1.1 * mm, 1.2 * mm
local high = HEIGHT - SCORE + BELOW
local drum = softvt.shape
  .cylinder { radius = LENGTH / 2 - LEAF - EDGE, height = high - 2 * EDGE }
  :round(EDGE)
  :translate(0, 0, high / 2 - BELOW)
local oval = drum:scale(1, 0.82, 1)
local bay = softvt.shape.cylinder { radius = 40 * mm, height = 0.2 }:translate(0, -56 * mm, 0)
local moon = oval:subtract(bay, 14 * mm)

local table_top = softvt.shape.box { size = { 0.2, 0.2, 0.02 } }:translate(0, 0, -0.01)
local leaves = { axis = "z", pitch = 6 * mm, height = LEAF, mask = { axis = "z", from = 30 * mm, to = 26 * mm } }
local scores =
  { axis = "z", radial_pitch = 8 * mm, height = SCORE, mask = { axis = "z", from = 29 * mm, to = 33 * mm } }
local CENTRE = 30 * mm
local layered =
  moon:ridges(leaves):translate(0, CENTRE, 0):ridges(scores):translate(0, -CENTRE, 0):subtract(table_top, 2 * mm)
local low, high = layered:bounds()
local middle = -0.5 * (low[2] + high[2])

-- Pale where the leaves have come apart and where the knife went.
local crust = material.crust {
  base = { 0.66, 0.32, 0.075 },
  top = { 0.42, 0.15, 0.02 },
  browning = 0.75,
  foot = { 0.76, 0.48, 0.19 },
  sheen = 0.25,
  rise_m = 8 * mm,
  seed = 91,
}
table.insert(crust.layers, {
  mask = softvt.mask.inside { shape = moon:round(0.4 * mm):translate(0, middle, 0), soft_m = 0.9 * mm },
  albedo = { 0.88, 0.68, 0.36 },
  roughness = 0.6,
  opacity = 0.8,
})

return softvt.asset {
  name = "curved_layered",
  shape = layered:translate(0, middle, 0),
  -- It is 6.8 voxels wide; with the usual six along its length it would be 4.1.
  body = softvt.soft {
    youngs_pa = 130e3,
    poisson = 0.38,
    density = 340,
    loss_factor = 0.15,
    resolution = 10,
    collapse_strain = 0.08,
    damage_strain = 0.07,
  },
  hints = { grasp_height_m = 18.5 * mm },
  visuals = { crust },
}
