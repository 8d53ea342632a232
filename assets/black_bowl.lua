-- A black bowl, 107 mm across and 51 mm high, on a low foot; its wall is 4.5 mm thick.
--
-- 58 g, as in LIBERO (100 kg/m³ of the box around it).
local material = require "materials"
local packaging = require "packaging"

local mm = 1e-3
local body = packaging.revolve {
  { 0, 0 },
  { 26, 0 },
  { 27, 1 },
  { 27.6, 4 },
  { 34.5, 7.5 },
  { 42, 14 },
  { 47.5, 22 },
  { 51, 31 },
  { 53, 41 },
  { 53.5, 49.5 },
  { 52.6, 51 },
  { 50, 51 },
  { 49, 49.5 },
  { 48.5, 41.5 },
  { 46.6, 32.5 },
  { 43.4, 24.4 },
  { 38.6, 17.4 },
  { 32.2, 11.8 },
  { 24, 8.4 },
  { 14, 7 },
  { 0, 6.6 },
}

-- A black glaze that breaks to iron brown where it ran thin: on the rim and the edge of the foot.
local rim = softvt.shape.torus { major = 51.3 * mm, minor = 2.2 * mm }:translate(0, 0, 50.5 * mm)
local foot = softvt.shape.torus { major = 27 * mm, minor = 1.4 * mm }:translate(0, 0, 2 * mm)
local glaze =
  material.ceramic { base = { 0.014, 0.014, 0.016 }, shade = { 0.026, 0.024, 0.024 }, roughness = 0.2, seed = 21 }
for _, edge in ipairs { rim, foot } do
  table.insert(glaze.layers, {
    mask = softvt.mask.inside { shape = edge, soft_m = 2.4 * mm },
    albedo = { 0.085, 0.040, 0.020 },
    roughness = 0.3,
    opacity = 0.8,
  })
end

return softvt.asset {
  name = "black_bowl",
  shape = body,
  body = softvt.rigid { density = 673.4 },
  -- Grasped by its rim from above, with the wall between the fingers: radius of the wall, and height of the tool
  -- centre.
  hints = { grasp_rim_m = 51 * mm, grasp_width_m = 5 * mm, grasp_height_m = 43 * mm, surface_m = 6.6 * mm },
  visuals = { glaze },
}
