-- A steamed bun with a face, 66 × 62 × 44 mm: a smooth cream dome on a flat base, two black eyes that look up and
-- forward (+x).
local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 66 * mm, 62 * mm, 44 * mm

-- The dome is the part of an ellipsoid above its lowest tenth, rounded into the base.
local BELOW = 6 * mm
local dome = softvt.shape.ellipsoid { size = { LENGTH, WIDTH, 2 * (HEIGHT + BELOW) / 2 } }
  :translate(0, 0, (HEIGHT + BELOW) / 2 - BELOW)
local base = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:translate(0, 0, -0.01)

local function eye(side)
  return softvt.shape.sphere { radius = 4.5 * mm }:translate(17 * mm, side * 10 * mm, 32.5 * mm)
end

local bun = dome:smooth_subtract(base, 4 * mm)
for _, side in ipairs { 1, -1 } do bun = bun:paint { material = 1, region = eye(side) } end

return softvt.asset {
  name = "steamed_bun",
  shape = bun,
  body = softvt.soft { youngs_pa = 25e3, poisson = 0.30, density = 180 },
  visuals = {
    { albedo = { 0.90, 0.85, 0.72 }, roughness = 0.6 },
    { albedo = { 0.02, 0.02, 0.02 }, roughness = 0.3 },
  },
}
