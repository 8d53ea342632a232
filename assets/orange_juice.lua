-- A carton of orange juice with a slanted top and a screw cap, 53 × 53 × 131 mm.
--
-- 37 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

local mm = 1e-3
-- The top falls towards +x; the cap stands square on the middle of it.
local HIGH, LOW, HALF = 124, 104, 26.5
local slope = math.atan(HIGH - LOW, 2 * HALF)
local carton = softvt.shape.prism {
  corners = { { -HALF * mm, 0 }, { HALF * mm, 0 }, { HALF * mm, LOW * mm }, { -HALF * mm, HIGH * mm } }, length = 2 * HALF * mm,
}
local cap = packages.turned { { 0, -3 }, { 11, -3 }, { 11, 14.019 }, { 0, 14.019 } }
  :rotate { axis = "y", angle = slope }:translate(0, 0, (HIGH + LOW) / 2 * mm)

return softvt.asset {
  name = "orange_juice",
  shape = carton:union(cap:paint { material = 1 }),
  body = softvt.rigid { density = 113.0 },
  visuals = { { albedo = { 0.9, 0.4, 0.02 } }, { albedo = { 0.1, 0.4, 0.05 } } },
}
