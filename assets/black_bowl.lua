-- A black bowl, 107 mm across and 51 mm high, on a low foot; its wall is 4.5 mm thick.
--
-- 58 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

local mm = 1e-3
local body = packages.turned {
  { 0, 0 }, { 26, 0 }, { 27, 1 }, { 27.6, 4 }, { 34.5, 7.5 }, { 42, 14 }, { 47.5, 22 }, { 51, 31 }, { 53, 41 }, { 53.5, 49.5 },
  { 52.6, 51 }, { 50, 51 }, { 49, 49.5 }, { 48.5, 41.5 }, { 46.6, 32.5 }, { 43.4, 24.4 }, { 38.6, 17.4 }, { 32.2, 11.8 },
  { 24, 8.4 }, { 14, 7 }, { 0, 6.6 },
}

return softvt.asset {
  name = "black_bowl",
  shape = body,
  body = softvt.rigid { density = 673.4 },
  -- It is taken by its rim from above, the wall between the fingers: where the wall is, and how high the tool centre then is.
  hints = { grasp_rim_m = 51 * mm, grasp_height_m = 42 * mm, surface_m = 6.6 * mm },
  visuals = { { albedo = { 0.02, 0.02, 0.02 }, roughness = 0.3 } },
}
