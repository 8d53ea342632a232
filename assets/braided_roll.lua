-- An elongated braided roll, 110 × 48 × 38 mm: golden lobes laid left and right in turn as in a plait, each with an
-- orange stripe of glaze along its crest.
local material = require "materials"

local mm = 1e-3
local TABLE_TOP = softvt.shape.box { size = { 0.2, 0.2, 0.02 } }:translate(0, 0, -0.01)

-- A lobe: a slanted ellipsoid that starts at the middle line and leans outwards; x in mm, side ±1, size of the whole.
local function lobe(x, side, size)
  local function place(shape)
    return shape:rotate { axis = "z", angle = side * 0.62 }:translate(x * mm, side * 7.5 * mm * size, 17 * mm)
  end
  local dough = place(softvt.shape.ellipsoid { size = { 43 * mm * size, 26 * mm * size, 42 * mm * size } })
  local stripe = place(softvt.shape.box { size = { 40 * mm, 3.6 * mm, 0.1 } })
  return dough:paint { material = 1, region = stripe }
end

-- Lobes get smaller towards the ends, as the dough of a plait does.
local braid = lobe(-40, 1, 0.78)
for _, next in ipairs {
  { -26, -1, 0.92 },
  { -12, 1, 1 },
  { 3, -1, 1 },
  { 17, 1, 0.98 },
  { 31, -1, 0.88 },
  { 41, 1, 0.74 },
} do
  braid = braid:smooth_union(lobe(table.unpack(next)), 3 * mm)
end

return softvt.asset {
  name = "braided_roll",
  shape = braid:subtract(TABLE_TOP, 4 * mm),
  -- It is 5.2 voxels wide; with the usual six along its length it would be 2.6.
  body = softvt.soft {
    youngs_pa = 90e3,
    poisson = 0.37,
    density = 300,
    loss_factor = 0.20,
    resolution = 12,
    collapse_strain = 0.10,
    damage_strain = 0.30,
  },
  hints = { grasp_height_m = 19 * mm },
  visuals = {
    material.crust {
      base = { 0.74, 0.405, 0.115 },
      top = { 0.50, 0.21, 0.035 },
      browning = 0.8,
      foot = { 0.80, 0.555, 0.27 },
      sheen = 0.30,
      seed = 41,
    },
    material.crust {
      base = { 0.76, 0.24, 0.03 },
      top = { 0.62, 0.16, 0.02 },
      foot = { 0.78, 0.34, 0.08 },
      sheen = 0.20,
      seed = 42,
    },
  },
}
