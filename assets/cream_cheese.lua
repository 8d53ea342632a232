-- A box of cream cheese, 81 × 43 × 18 mm.
--
-- 6 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local BLUE, SKY, WHITE, SILVER =
  { 0.015, 0.075, 0.33 }, { 0.16, 0.42, 0.74 }, { 0.88, 0.89, 0.88 }, { 0.60, 0.64, 0.68 }

-- Snowy hills under a sky; the name on the snow.
local top = packaging.label { on = { "+z" }, out = 18 }
top.bar(0, 11.5, 81, 20, BLUE)
top.polygon(-21, 1.5, { { -20, 0 }, { 20, 0 }, { 3, 15 }, { -2, 15.5 } }, SKY)
top.polygon(18, 1.5, { { -24, 0 }, { 22, 0 }, { 4, 17 }, { -1, 17.5 } }, SKY)
top.polygon(-20.5, 10.5, { { -8.6, 0 }, { -4, -1.8 }, { 0, 0.4 }, { 4, -2 }, { 9, 0 }, { 3, 6.4 }, { -2, 6.9 } }, WHITE)
top.polygon(
  18.5,
  11.5,
  { { -9.4, 0 }, { -4, -2 }, { 0, 0.4 }, { 5, -2 }, { 10.6, 0 }, { 4, 7.2 }, { -1.5, 7.7 } },
  WHITE
)
top.text("CREAM CHEESE", 0, -5.2, 6.0, BLUE, { weight = 0.2 })
top.text("SNOWFIELD", 0, -14.4, 3.4, SKY, { weight = 0.16 })
top.text("soft & mild", 29, -14.4, 2.6, BLUE)
top.text("200 g", -31, -14.4, 2.6, BLUE)

local sides = packaging.label { on = { "+y", "-y" }, out = 21.5 }
sides.bar(0, 9, 81, 10, WHITE)
sides.text("CREAM CHEESE", 0, 9, 5.2, BLUE, { weight = 0.18 })
local ends = packaging.label { on = { "+x", "-x" }, out = 40.5 }
ends.bar(0, 9, 43, 10, WHITE)
ends.text("SNOWFIELD", 0, 9, 4, BLUE, { weight = 0.18 })

local layers = { { mask = softvt.mask.facing { from = 0.9, to = 0.95 }, albedo = WHITE, roughness = 0.34 } }
for _, more in ipairs { top, sides, ends } do
  table.move(more.layers, 1, #more.layers, #layers + 1, layers)
end

return softvt.asset {
  name = "cream_cheese",
  shape = packaging.carton(81, 43, 18),
  body = softvt.rigid { density = 100 },
  visuals = { { albedo = BLUE, roughness = 0.34, layers = layers } },
}
