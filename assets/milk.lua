-- A carton of milk with a gable top, 53 × 53 × 131 mm.
--
-- 37 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local BLUE, DEEP, WHITE, BLACK =
  { 0.03, 0.16, 0.55 }, { 0.012, 0.045, 0.24 }, { 0.86, 0.87, 0.86 }, { 0.02, 0.02, 0.025 }
local mm = 1e-3

-- The gable seen along y: the roof rises to a fin.
local shape = packaging.extrude({
  { -26.5, 0 },
  { 26.5, 0 },
  { 26.5, 99 },
  { 2.2, 121 },
  { 2.2, 131 },
  { -2.2, 131 },
  { -2.2, 121 },
  { -26.5, 99 },
}, 53)

-- A cow's patches below, the sky above.
local label = packaging.label { on = { "+x", "-x", "+y", "-y" }, out = 26.5 }
local patches = softvt.mask.noise { size_m = 22 * mm, octaves = 2, from = 0.535, to = 0.55, seed = 11 }
label.ink(patches:intersect(softvt.mask.inside { shape = packaging.band(-1, 40) }), BLACK)
label.belt(90, 99, BLUE)
label.belt(99, 140, DEEP)
label.belt(88, 88.8, BLUE)
label.text("MILK", 0, 65, 12.4, BLUE, { weight = 0.2 })
label.text("whole & fresh", 0, 51, 4.2, DEEP, { weight = 0.12 })
label.text("MEADOWBELL", 0, 94.5, 4.4, WHITE, { weight = 0.16 })
label.text("1 L", 17, 80, 4.2, DEEP)
-- A drop.
label.oval(-15, 79.5, 6, 6, BLUE)
label.polygon(-15, 80.1, { { -2.7, 0 }, { 2.7, 0 }, { 0, 6 } }, BLUE)
-- Folds of the gable ends.
for _, side in ipairs { -1, 1 } do
  local fold = packaging.label { on = { "+y", "-y" }, out = 26.5 }
  fold.bar(side * 12.4, 110, 0.7, 34, { 0.10, 0.20, 0.52 }, { lean = side * 0.835 })
  table.move(fold.layers, 1, #fold.layers, #label.layers + 1, label.layers)
end

return softvt.asset {
  name = "milk",
  shape = shape,
  body = softvt.rigid { density = 117.2 },
  -- The lowest grasp that the palm, 39 mm above the tool centre, allows.
  hints = { grasp_height_m = 94 * mm },
  visuals = { { albedo = WHITE, roughness = 0.38, layers = label.layers } },
}
