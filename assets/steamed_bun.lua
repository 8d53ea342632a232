-- A steamed bun with a face, 66 × 62 × 44 mm: a smooth cream dome on a flat base, two black eyes that look up and
-- forward (+x).
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 66 * mm, 62 * mm, 44 * mm

-- The dome is the part of an ellipsoid above the table, its lower edge rounded.
local BELOW = 6 * mm
local dome = softvt.shape.ellipsoid { size = { LENGTH, WIDTH, HEIGHT + BELOW } }:translate(0, 0, (HEIGHT - BELOW) / 2)
local table_top = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:translate(0, 0, -0.01)

local bun = dome:subtract(table_top, 4 * mm)

local skin = material.dough { seed = 81 }
for _, side in ipairs { -1, 1 } do
  local eye = softvt.shape.sphere { radius = 4 * mm }:translate(21 * mm, side * 9 * mm, 36 * mm)
  -- Not too glossy, since the reflection of a lamp would make an eye white.
  table.insert(skin.layers, {
    mask = softvt.mask.inside { shape = eye, soft_m = 1.5 * mm },
    albedo = { 0.012, 0.011, 0.010 },
    roughness = 0.6,
  })
end

return softvt.asset {
  name = "steamed_bun",
  shape = bun,
  body = softvt.soft {
    youngs_pa = 25e3,
    poisson = 0.30,
    density = 180,
    loss_factor = 0.20,
    collapse_strain = 0.12,
    damage_strain = 0.40,
  },
  hints = { grasp_height_m = 22 * mm },
  visuals = { skin },
}
