-- An object: shape, body and visual materials. Lengths are in metres; z is up. Calibrate it once, so that episodes with
-- it can be judged safe:
--
--   softvt scripts/calibrate.lua --asset my_object
local material = require "materials"
local mm = 1e-3

-- A loaf, 56 × 40 × 34 mm: a rounded box, notched across its top. grounded() moves its lowest point to z = 0 and its
-- centre onto the z axis.
local notches = { axis = "x", pitch = 11 * mm, height = -1.5 * mm, mask = { axis = "z", from = 4 * mm, to = 10 * mm } }
local loaf = softvt.shape.box { size = { 40 * mm, 24 * mm, 18 * mm } }:round(8 * mm):ridges(notches):grounded()

return softvt.asset {
  name = "my_object",
  shape = loaf,
  -- Young's modulus (Pa), Poisson's ratio, density (kg/m³), and the compressive strains at which the material collapses
  -- and is damaged, which limit its calibration. Alternatives: softvt.rigid { density = 400 }, softvt.static {}.
  body = softvt.soft { youngs_pa = 60e3, poisson = 0.35, density = 250, collapse_strain = 0.10, damage_strain = 0.30 },
  -- One visual material for each painted part of the shape; this shape has one part.
  visuals = { material.crust { seed = 7 } },
}
