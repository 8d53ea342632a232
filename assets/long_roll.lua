-- A long soft bread roll, 120 × 44 × 38 mm: a golden loaf with rounded ends, slashed three times across its top, where
-- the crumb has opened.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 120 * mm, 44 * mm, 38 * mm

-- A thick capsule made slim: its ends taper over this length.
local TAPER, BELOW = 38 * mm, 5 * mm
local loaf = softvt.shape
  .capsule { radius = TAPER, length = LENGTH }
  :rotate { axis = "y", angle = math.pi / 2 }
  :scale(1, WIDTH / (2 * TAPER), (HEIGHT + BELOW) / (2 * TAPER))
  :translate(0, 0, (HEIGHT - BELOW) / 2)
local table_top = softvt.shape.box { size = { 0.2, 0.1, 0.02 } }:translate(0, 0, -0.01)

-- Slashes: lens-shaped, aslant.
local slashed, crumb = loaf:subtract(table_top, 4 * mm), nil
for _, x in ipairs { -31, 0, 31 } do
  local function lens(grown)
    return softvt.shape
      .ellipsoid { size = { (33 + grown) * mm, (8 + grown) * mm, (9 + grown) * mm } }
      :rotate { axis = "z", angle = math.rad(32) }
      :translate(x * mm, 0, HEIGHT - 0.02 * math.abs(x) * mm)
  end
  slashed = slashed:subtract(lens(0), 3 * mm)
  crumb = crumb and crumb:union(lens(2)) or lens(2)
end

local crust = material.crust {
  base = { 0.70, 0.37, 0.105 },
  top = { 0.46, 0.175, 0.032 },
  browning = 0.8,
  foot = { 0.80, 0.57, 0.29 },
  sheen = 0.36,
  seed = 11,
}
table.insert(crust.layers, {
  mask = softvt.mask.inside { shape = crumb, soft_m = 2 * mm },
  albedo = { 0.86, 0.70, 0.44 },
  roughness = 0.75,
  opacity = 0.92,
})

return softvt.asset {
  name = "long_roll",
  shape = slashed,
  -- It is 4.4 voxels wide; with the usual six along its length it would be 2.2.
  body = softvt.soft {
    youngs_pa = 35e3,
    poisson = 0.32,
    density = 200,
    loss_factor = 0.20,
    resolution = 12,
    collapse_strain = 0.10,
    damage_strain = 0.35,
  },
  hints = { grasp_height_m = 19 * mm, carry_pace = 0.25 },
  visuals = { material.floured(crust, { seed = 15, opacity = 0.25 }) },
}
