-- A carton of milk with a gable top, 53 × 53 × 131 mm.
--
-- 37 g, as in LIBERO (100 kg/m³ of the box around it).
local packages = require "packages"

local BLUE, DEEP, WHITE, BLACK = { 0.03, 0.16, 0.55 }, { 0.012, 0.045, 0.24 }, { 0.86, 0.87, 0.86 }, { 0.02, 0.02, 0.025 }
local mm = 1e-3

-- The gable seen along y: the roof rises to a fin.
local shape = packages.drawn({
  { -26.5, 0 }, { 26.5, 0 }, { 26.5, 94 }, { 2.2, 120 }, { 2.2, 131 }, { -2.2, 131 }, { -2.2, 120 }, { -26.5, 94 },
}, 53)

-- A cow's patches below, the sky above.
local label = packages.label { on = { "+x", "-x", "+y", "-y" }, out = 26.5 }
local patches = softvt.mask.noise { size_m = 22 * mm, octaves = 2, from = 0.535, to = 0.55, seed = 11 }
label.ink(patches:both(softvt.mask.inside { shape = packages.band(-1, 40) }), BLACK)
label.belt(86, 94, BLUE)
label.belt(94, 140, DEEP)
label.belt(84, 84.8, BLUE)
label.text("MILK", 0, 62, 12.4, BLUE, { weight = 0.2 })
label.text("whole & fresh", 0, 48.5, 4.2, DEEP, { weight = 0.12 })
label.text("MEADOWBELL", 0, 90, 4.4, WHITE, { weight = 0.16 })
label.text("1 L", 17, 76.5, 4.2, DEEP)
-- A drop.
label.oval(-15, 77, 6, 6, BLUE)
label.polygon(-15, 77.6, { { -2.7, 0 }, { 2.7, 0 }, { 0, 6 } }, BLUE)
-- Folds of the gable ends.
for _, side in ipairs { -1, 1 } do
  local fold = packages.label { on = { "+y", "-y" }, out = 26.5 }
  fold.bar(side * 12, 106.5, 0.7, 36, { 0.10, 0.20, 0.52 }, { lean = side * 0.72 })
  table.move(fold.layers, 1, #fold.layers, #label.layers + 1, label.layers)
end

return softvt.asset {
  name = "milk",
  shape = shape,
  body = softvt.rigid { density = 120.2 },
  visuals = { { albedo = WHITE, roughness = 0.38, layers = label.layers } },
}
