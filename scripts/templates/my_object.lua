-- An object: how large it is, what it is made of, what it looks like. Lengths are metres; z is up. Calibrate it once, so
-- that episodes with it can be called safe:
--
--   softvt scripts/calibrate.lua --asset my_object
local material = require "materials"
local mm = 1e-3

-- A loaf, 56 × 40 × 34 mm: a rounded box, notched across its top. Its lowest point comes to z = 0, its middle onto the z axis.
local notches = { axis = "x", pitch = 11 * mm, height = -1.5 * mm, mask = { axis = "z", from = 4 * mm, to = 10 * mm } }
local loaf = softvt.shape.box { size = { 40 * mm, 24 * mm, 18 * mm } }:round(8 * mm):ridges(notches):grounded()

return softvt.asset {
  name = "my_object",
  shape = loaf,
  -- Soft: stiffness, Poisson's ratio, density (kg/m³). Or softvt.rigid { density = 400 }, or softvt.static {}.
  body = softvt.soft { youngs_pa = 60e3, poisson = 0.35, density = 250 },
  -- One look for each painted part of the shape; this one is all crust.
  visuals = { material.crust { seed = 7 } },
}
