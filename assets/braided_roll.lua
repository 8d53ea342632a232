-- An elongated braided roll, 110 × 48 × 38 mm: golden lobes laid left and right in turn as in a plait, each with an
-- orange stripe of glaze along its crest.
local mm = 1e-3
local BASE = softvt.shape.box { size = { 0.2, 0.2, 0.02 } }:translate(0, 0, -0.01)

-- A lobe: a slanted ellipsoid that starts at the middle line and leans outwards.
local function lobe(x, side, share)
  local place = function(shape)
    return shape:rotate { axis = "z", angle = side * 0.62 }:translate(x, side * 9.2 * mm * share, 17 * mm)
  end
  local size = { 43 * mm * share, 26 * mm * share, 40 * mm * share }
  local dough = place(softvt.shape.ellipsoid { size = size })
  local stripe = place(softvt.shape.box { size = { 40 * mm, 3.6 * mm, 0.1 } })
  return dough:paint { material = 1, region = stripe }
end

-- Lobes get smaller towards the ends, as the dough of a plait does.
local lobes = {
  { -38, 1, 0.78 }, { -25, -1, 0.92 }, { -11, 1, 1 }, { 4, -1, 1 }, { 18, 1, 0.98 }, { 31, -1, 0.88 }, { 40, 1, 0.74 },
}
local braid
for _, spec in ipairs(lobes) do
  local one = lobe(spec[1] * mm, spec[2], spec[3])
  braid = braid and braid:smooth_union(one, 3 * mm) or one
end

return softvt.asset {
  name = "braided_roll",
  shape = braid:smooth_subtract(BASE, 4 * mm),
  body = softvt.soft { youngs_pa = 90e3, poisson = 0.37, density = 300 },
  visuals = {
    { albedo = { 0.74, 0.48, 0.17 }, roughness = 0.5 },
    { albedo = { 0.80, 0.27, 0.04 }, roughness = 0.4 },
  },
}
