-- A tin of tomato sauce, 62 mm across and 76 mm high.
--
-- 29 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

return softvt.asset {
  name = "tomato_sauce",
  shape = packages.can(),
  body = softvt.rigid { density = 136.9 },
  visuals = { { albedo = { 0.7, 0.1, 0.05 } } },
}
