-- A bottle of salad dressing, 53 × 36 × 146 mm.
--
-- 28 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local CREAM, GREEN, LEAF, DARK =
  { 0.90, 0.86, 0.70 }, { 0.03, 0.20, 0.04 }, { 0.13, 0.40, 0.05 }, { 0.012, 0.07, 0.018 }
local mm = 1e-3

local glass = packaging
  .revolve {
    { 0, 0 },
    { 26.5, 0 },
    { 26.5, 110 },
    { 25.5, 112.5 },
    { 21, 117 },
    { 16, 120 },
    { 14, 122.5 },
    { 14, 127 },
    { 0, 127 },
  }
  :scale(1, 36 / 53, 1)
local cap = packaging.revolve { { 0, 125 }, { 12, 125 }, { 12, 144.8 }, { 11, 146 }, { 0, 146 } }:paint { material = 1 }

-- Through the glass: vinegar with herbs below, oil above it, air in the neck; deeper in colour where one looks through
-- more.
local label = packaging.label { on = { "+y", "-y" }, out = 17.5, round = 3 }
local facing = softvt.mask.facing
local herbs = softvt.mask.specks { spacing_m = 4.5 * mm, radius_m = 0.9 * mm, seed = 5 }
label.ink(softvt.mask.gradient { from_m = 90 * mm, to_m = 96 * mm }, { 0.86, 0.66, 0.12 }, { roughness = 0.12 })
label.ink(softvt.mask.gradient { from_m = 116 * mm, to_m = 117 * mm }, { 0.70, 0.74, 0.66 }, { roughness = 0.12 })
label.ink(herbs:intersect(softvt.mask.inside { shape = packaging.band(-1, 94) }), LEAF, { roughness = 0.14 })
for _, axis in ipairs { "x", { -1, 0, 0 } } do
  label.ink(facing { axis = axis, from = 0.55, to = 1 }, { 0.42, 0.20, 0.02 }, { roughness = 0.12, opacity = 0.6 })
end
label.belt(10, 74, DARK)
label.belt(11, 73, CREAM)
label.belt(11, 15, GREEN)
label.belt(69, 73, GREEN)
label.text("HERB", 0, 60, 7.4, GREEN, { weight = 0.2 })
label.text("DRESSING", 0, 50, 5, GREEN, { weight = 0.18 })
label.text("LITTLE GARDEN", 0, 71, 2.4, CREAM, { weight = 0.16 })
-- A sprig.
label.bar(0, 29, 0.9, 22, GREEN)
for i = 0, 3 do
  for _, side in ipairs { -1, 1 } do
    label.leaf(side * 5.4, 23 + 5.2 * i, 10.5 - i, side * 0.62, i % 2 == 0 and LEAF or GREEN)
  end
end
label.leaf(0, 43, 8, math.pi / 2, LEAF)

return softvt.asset {
  name = "salad_dressing",
  shape = glass:union(cap),
  body = softvt.rigid { density = 148.6 },
  -- The lowest grasp that the palm, 39 mm above the tool centre, allows.
  hints = { grasp_height_m = 109 * mm },
  visuals = {
    { albedo = { 0.66, 0.36, 0.045 }, roughness = 0.12, layers = label.layers },
    { albedo = GREEN, roughness = 0.35 },
  },
}
