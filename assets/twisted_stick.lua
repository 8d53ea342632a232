-- A twisted bread stick, 120 × 31 × 28 mm: two strands of dough laid around each other one and a half times, brushed
-- with egg and strewn with coarse sugar.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 120 * mm, 31 * mm, 28 * mm

-- The strands end rounded, side by side. Below the table top the rope is cut off, so that it does not roll.
local STRAND, BELOW = 8.6 * mm, 2 * mm
local strand = softvt.shape.capsule { radius = STRAND, length = LENGTH }:rotate { axis = "y", angle = math.pi / 2 }
local apart = WIDTH / 2 - STRAND
local rope = strand
  :translate(0, apart, 0)
  :smooth_union(strand:translate(0, -apart, 0), 5 * mm)
  :twist { axis = "x", rate = 3 * math.pi / LENGTH }
local flat = rope:scale(1, 1, (HEIGHT + BELOW) / WIDTH):translate(0, 0, (HEIGHT - BELOW) / 2)
local table_top = softvt.shape.box { size = { 0.2, 0.1, 0.02 } }:translate(0, 0, -0.01)

-- Dough that was covered while it baked: near the middle line, where the strands meet.
local seam = softvt.shape
  .cylinder { radius = 9.5 * mm, height = 0.2 }
  :rotate { axis = "y", angle = math.pi / 2 }
  :translate(0, 0, (HEIGHT - BELOW) / 2)

local crust = material.crust {
  base = { 0.60, 0.30, 0.075 },
  top = { 0.36, 0.125, 0.022 },
  browning = 0.75,
  foot = { 0.76, 0.50, 0.22 },
  sheen = 0.34,
  rise_m = 9 * mm,
  seed = 31,
}
table.insert(crust.layers, {
  mask = softvt.mask.inside { shape = seam, soft_m = 5 * mm },
  albedo = { 0.82, 0.60, 0.30 },
  roughness = 0.6,
  opacity = 0.85,
})
table.insert(crust.layers, {
  mask = softvt.mask
    .specks { spacing_m = 4.6 * mm, radius_m = 0.8 * mm, seed = 34 }
    :intersect(softvt.mask.facing { from = 0.45, to = 0.8 }),
  albedo = { 0.90, 0.86, 0.78 },
  roughness = 0.2,
  opacity = 0.9,
  relief_m = 0.35 * mm,
})

return softvt.asset {
  name = "twisted_stick",
  shape = flat:subtract(table_top, 2 * mm),
  -- It is 4.1 voxels wide; with the usual six along its length it would be 1.6.
  body = softvt.soft {
    youngs_pa = 75e3,
    poisson = 0.36,
    density = 280,
    loss_factor = 0.20,
    resolution = 16,
    collapse_strain = 0.10,
    damage_strain = 0.20,
  },
  hints = { grasp_height_m = 18.5 * mm },
  visuals = { crust },
}
