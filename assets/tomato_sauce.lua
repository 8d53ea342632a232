-- A tin of tomato sauce, 62 mm across and 76 mm high.
--
-- 29 g, as in LIBERO (100 kg/m³ of the box around it).
local material = require "materials"
local packaging = require "packaging"

local RED, CREAM, GREEN, DARK =
  { 0.56, 0.022, 0.014 }, { 0.89, 0.80, 0.58 }, { 0.025, 0.19, 0.03 }, { 0.30, 0.010, 0.008 }

local label = packaging.label { on = { "+x", "-x" }, out = 30.2, wrap = 30.2, round = 8 }
label.belt(40, 72.4, DARK)
label.belt(38, 39, DARK)
label.belt(4, 7, GREEN)
label.text("TOMATO", 0, 60.5, 8, CREAM, { weight = 0.2 })
label.text("SAUCE", 0, 47.5, 6.4, CREAM, { weight = 0.18 })
-- Three tomatoes: a light on each, leaves on top.
for _, x in ipairs { -17, 17, 0 } do
  local y = x == 0 and 21 or 22
  label.oval(x, y, 23, 21, DARK)
  label.oval(x, y, 21.6, 19.6, RED)
  label.oval(x - 4, y + 4, 5, 3.4, { 0.80, 0.25, 0.18 }, { lean = 0.6 })
  for i = -2, 2 do
    label.leaf(x + 2.6 * i, y + 8.8 - 0.7 * math.abs(i), 7, math.pi / 2 - 0.55 * i, GREEN)
  end
end

return softvt.asset {
  name = "tomato_sauce",
  shape = packaging.can(),
  body = softvt.rigid { density = 136.9 },
  visuals = { material.steel { along = "x", seed = 13 }, { albedo = CREAM, roughness = 0.42, layers = label.layers } },
}
