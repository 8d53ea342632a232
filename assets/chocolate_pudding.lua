-- A cup of chocolate pudding, 80 × 46 × 27 mm: an oval tub under a lid of foil.
--
-- 10 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

local tub = packages.turned {
  { 0, 0 }, { 32, 0 }, { 33.5, 1.5 }, { 37, 22.6 }, { 39.6, 23.4 }, { 40, 24.2 }, { 40, 26.2 }, { 39.2, 27 }, { 0, 27 },
}

return softvt.asset {
  name = "chocolate_pudding",
  shape = tub:scale(1, 46 / 80, 1),
  body = softvt.rigid { density = 158.4 },
  visuals = { { albedo = { 0.2, 0.07, 0.03 } } },
}
