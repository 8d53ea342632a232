-- A glazed porcelain ramekin, 89 mm across and 42 mm high, fluted outside; its wall is 5 mm thick.
--
-- 33 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

local mm = 1e-3
local body = packages.turned {
  { 0, 0 }, { 40, 0 }, { 41, 1 }, { 43, 32 }, { 44.5, 34 }, { 44.5, 40.5 }, { 43.5, 42 }, { 40.5, 42 }, { 39.3, 40.5 },
  { 37, 9 }, { 34, 6.4 }, { 0, 6 },
}

return softvt.asset {
  name = "ramekin",
  shape = body,
  body = softvt.rigid { density = 436.5 },
  hints = { grasp_rim_m = 42 * mm, grasp_height_m = 33 * mm, surface_m = 6 * mm },
  visuals = { { albedo = { 0.8, 0.8, 0.75 }, roughness = 0.2 } },
}
