-- An oval loaf with ridges, 84 × 59 × 44 mm: a rustic loaf proved in a cane basket, which left broad ridges aslant over
-- it, floured on their crests.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 84 * mm, 59 * mm, 44 * mm

local GROOVE, BELOW, TAPER = 2.6 * mm, 6 * mm, 37 * mm
local function oval(deep)
  return softvt.shape
    .capsule { radius = TAPER, length = LENGTH - 2 * deep }
    :rotate { axis = "y", angle = math.pi / 2 }
    :scale(1, (WIDTH - 2 * deep) / (2 * TAPER), (HEIGHT + BELOW - 2 * deep) / (2 * TAPER))
    :translate(0, 0, (HEIGHT - BELOW) / 2)
end
local table_top = softvt.shape.box { size = { 0.2, 0.2, 0.02 } }:translate(0, 0, -0.01)

-- Grooves between the ridges, aslant; they fade towards the flat base.
local SLANT = math.rad(24)
local grooves = {
  axis = "x",
  pitch = 13 * mm,
  height = -GROOVE,
  sharpness = 1.7,
  phase = math.pi,
  mask = { axis = "z", from = 3 * mm, to = 12 * mm },
}
local loaf = oval(0):rotate { axis = "z", angle = -SLANT }:ridges(grooves):rotate { axis = "z", angle = SLANT }

local crust = material.crust {
  base = { 0.50, 0.255, 0.085 },
  top = { 0.30, 0.115, 0.028 },
  browning = 0.8,
  foot = { 0.66, 0.43, 0.20 },
  sheen = 0.55,
  seed = 111,
}
table.insert(crust.layers, {
  mask = softvt.mask.inside { shape = oval(1.2 * mm), soft_m = 1.4 * mm },
  albedo = { 0.70, 0.47, 0.22 },
  roughness = 0.7,
  opacity = 0.85,
})

return softvt.asset {
  name = "oval_loaf",
  shape = loaf:subtract(table_top, 4 * mm),
  -- It is 5.6 voxels wide; with the usual six along its length it would be 4.2.
  body = softvt.soft {
    youngs_pa = 180e3,
    poisson = 0.37,
    density = 350,
    loss_factor = 0.20,
    resolution = 8,
    collapse_strain = 0.12,
    damage_strain = 0.12,
  },
  hints = { grasp_height_m = 22 * mm },
  visuals = { material.floured(crust, { seed = 115, opacity = 0.6, size_m = 4 * mm }) },
}
