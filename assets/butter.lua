-- A packet of butter, 76 × 40 × 17 mm.
--
-- 5 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local GOLD, CREAM, GREEN, BROWN =
  { 0.84, 0.53, 0.06 }, { 0.91, 0.85, 0.62 }, { 0.03, 0.20, 0.06 }, { 0.24, 0.09, 0.012 }

-- On top a cream field with a frame and the name; marks for slices along the sides.
local top = packaging.label { on = { "+z" }, out = 17 }
top.bar(0, 0, 68, 32, GREEN)
top.bar(0, 0, 66.4, 30.4, CREAM)
top.text("BUTTER", 0, 1.5, 10.5, GREEN, { weight = 0.22 })
top.text("GOLDEN PASTURE", 0, 11, 3, BROWN, { weight = 0.14 })
top.text("salted · 250 g", 0, -9.5, 3, BROWN, { weight = 0.12 })
for _, side in ipairs { -1, 1 } do
  for i = 1, 2 do
    top.leaf(side * 27.5, -9.5, 6, side * (0.5 - 0.9 * i), GREEN)
  end
end

local sides = packaging.label { on = { "+y", "-y" }, out = 20 }
sides.text("BUTTER", 0, 10, 6, GREEN, { weight = 0.2 })
for i = -4, 4 do
  if math.abs(i) > 2 then
    sides.bar(8 * i, 3.5, 0.7, 5, BROWN)
  else
    sides.bar(8 * i, 2, 0.7, 2.4, BROWN)
  end
end
local ends = packaging.label { on = { "+x", "-x" }, out = 38 }
ends.bar(0, 8.5, 30, 11, CREAM)
ends.text("BUTTER", 0, 8.5, 4.4, GREEN, { weight = 0.2 })

local layers = top.layers
for _, more in ipairs { sides, ends } do
  table.move(more.layers, 1, #more.layers, #layers + 1, layers)
end

return softvt.asset {
  name = "butter",
  shape = packaging.carton(76, 40, 17),
  body = softvt.rigid { density = 100 },
  visuals = { { albedo = GOLD, roughness = 0.36, layers = layers } },
}
