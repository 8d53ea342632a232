-- A ramekin of glazed porcelain, 89 mm across and 42 mm high, fluted outside; its wall is 4 to 5 mm thick.
--
-- 33 g, as in LIBERO (100 kg/m³ of the box around it). A black bowl set into it rests 29.7 mm up.
local material = require "materials"
local packaging = require "packaging"

local mm = 1e-3
-- Flutes are cut into the side below a plain lip. They are filled above the foot, so that the foot has a plain edge.
local function flutes(depth, from, to)
  return { axis = "z", count = 40, height = depth, mask = { axis = "z", from = from * mm, to = to * mm } }
end
local solid = packaging
  .revolve { { 0, 0 }, { 42, 0 }, { 43.4, 32 }, { 44.5, 34.4 }, { 44.5, 41 }, { 43.5, 42 }, { 0, 42 } }
  :ridges(flutes(-1 * mm, 33.5, 30))
  :ridges(flutes(1 * mm, 8, 4))
local hollow =
  packaging.revolve { { 0, 6 }, { 34, 6 }, { 36.4, 9 }, { 38.5, 39 }, { 39.8, 42.1 }, { 39.8, 50 }, { 0, 50 } }

-- White glaze that pools blue-green where it is thick, inside at the bottom.
local glaze =
  material.ceramic { base = { 0.84, 0.85, 0.81 }, shade = { 0.76, 0.79, 0.74 }, roughness = 0.16, seed = 31 }
local pool = softvt.shape.torus { major = 35.5 * mm, minor = 3 * mm }:translate(0, 0, 7.5 * mm)
table.insert(glaze.layers, {
  mask = softvt.mask.inside { shape = pool, soft_m = 8 * mm },
  albedo = { 0.48, 0.63, 0.60 },
  roughness = 0.14,
  opacity = 0.8,
})

return softvt.asset {
  name = "ramekin",
  shape = solid:subtract(hollow),
  body = softvt.rigid { density = 392.0 },
  hints = { grasp_rim_m = 42 * mm, grasp_width_m = 5 * mm, grasp_height_m = 33 * mm, surface_m = 6 * mm },
  visuals = { glaze },
}
