-- A box of cream cheese, 81 × 43 × 18 mm.
--
-- 6 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

return softvt.asset {
  name = "cream_cheese",
  shape = packages.carton(81, 43, 18),
  body = softvt.rigid { density = 100 },
  visuals = { { albedo = { 0.2, 0.3, 0.8 } } },
}
