-- A bottle of salad dressing, 53 × 36 × 146 mm.
--
-- 28 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

local glass = packages.turned {
  { 0, 0 }, { 26.5, 0 }, { 26.5, 82 }, { 25.5, 88 }, { 21, 97 }, { 16, 104 }, { 14, 112 }, { 14, 124 }, { 0, 124 },
}:scale(1, 36 / 53, 1)
local cap = packages.turned { { 0, 121 }, { 12, 121 }, { 12, 144.8 }, { 11, 146 }, { 0, 146 } }:paint { material = 1 }

return softvt.asset {
  name = "salad_dressing",
  shape = glass:union(cap),
  body = softvt.rigid { density = 167.9 },
  visuals = { { albedo = { 0.6, 0.4, 0.1 } }, { albedo = { 0.1, 0.3, 0.05 } } },
}
