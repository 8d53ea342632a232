-- A squeeze bottle of ketchup, 56 × 37 × 146 mm.
--
-- 30 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

local bottle = packages.turned {
  { 0, 0 }, { 28, 0 }, { 28, 40 }, { 26.5, 62 }, { 25.5, 84 }, { 24.5, 100 }, { 21.5, 111 }, { 17, 117 },
  { 16, 120 }, { 0, 120 },
}:scale(1, 37 / 56, 1)
local cap = packages.turned {
  { 0, 116 }, { 14, 116 }, { 14, 128 }, { 12.5, 129.5 }, { 7, 131.5 }, { 4.6, 134 }, { 3, 145 }, { 2.2, 146 }, { 0, 146 },
}:paint { material = 1 }

return softvt.asset {
  name = "ketchup",
  shape = bottle:union(cap),
  body = softvt.rigid { density = 171.4 },
  visuals = { { albedo = { 0.6, 0.03, 0.01 } }, { albedo = { 0.8, 0.8, 0.8 } } },
}
