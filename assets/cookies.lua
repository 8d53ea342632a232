-- A box of cookies, 62 × 83 × 19 mm, lying.
--
-- 10 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

return softvt.asset {
  name = "cookies",
  shape = packages.carton(62, 83, 19),
  body = softvt.rigid { density = 100 },
  visuals = { { albedo = { 0.6, 0.1, 0.1 } } },
}
