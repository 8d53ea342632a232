-- A flat bottle of barbecue sauce, 47 × 29 × 107 mm.
--
-- 15 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

local glass = packages.turned {
  { 0, 0 }, { 23.5, 0 }, { 23.5, 66 }, { 22.5, 72 }, { 19, 79 }, { 14.5, 85 }, { 13, 90 }, { 0, 90 },
}:scale(1, 29 / 47, 1)
local cap = packages.turned { { 0, 88 }, { 10, 88 }, { 10, 106 }, { 9, 107 }, { 0, 107 } }:paint { material = 1 }

return softvt.asset {
  name = "bbq_sauce",
  shape = glass:union(cap),
  body = softvt.rigid { density = 156.6 },
  visuals = { { albedo = { 0.1, 0.03, 0.01 } }, { albedo = { 0.02, 0.02, 0.02 } } },
}
