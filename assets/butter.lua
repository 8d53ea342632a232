-- A packet of butter, 76 × 40 × 17 mm.
--
-- 5 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

return softvt.asset {
  name = "butter",
  shape = packages.carton(76, 40, 17),
  body = softvt.rigid { density = 100 },
  visuals = { { albedo = { 0.9, 0.7, 0.2 } } },
}
