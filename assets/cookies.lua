-- A box of cookies, 62 × 83 × 19 mm, lying.
--
-- 10 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local RED, CREAM, DOUGH, CHIP =
  { 0.42, 0.018, 0.022 }, { 0.90, 0.81, 0.60 }, { 0.56, 0.27, 0.075 }, { 0.055, 0.018, 0.007 }

-- On top, read from +x: the name, and three cookies with chips.
local top = packaging.label { on = { "+z" }, out = 19, turn = math.pi / 2 }
local CHIPS = { { -5.5, 3 }, { 0.5, 6 }, { 5, 2.5 }, { -2, -1 }, { 3.5, -4 }, { -5, -4.5 }, { 0, -7.5 } }
for _, at in ipairs { { -24, -11 }, { 24, -11 }, { 0, -13 } } do
  local x, y = table.unpack(at)
  top.oval(x, y, 25.5, 25.5, { 0.30, 0.12, 0.03 })
  top.oval(x, y, 24, 24, DOUGH)
  top.oval(x - 0.8, y + 0.8, 17, 17, { 0.66, 0.36, 0.115 }, { opacity = 0.7, soft = 5 })
  for i, chip in ipairs(CHIPS) do
    top.oval(x + chip[1], y + chip[2], 3.6 - 0.3 * (i % 3), 3.1, CHIP)
  end
end
top.bar(0, 15, 83, 19, CREAM)
top.bar(0, 6.4, 83, 0.8, DOUGH)
top.text("COOKIES", 0, 17.2, 9.4, RED, { weight = 0.22 })
top.text("with dark chocolate chips", 0, 9, 2.3, CHIP, { weight = 0.1 })
top.text("CRUMBLE & CO", 0, 27.3, 3.2, CREAM, { weight = 0.16 })

local layers = top.layers
for _, face in ipairs { { { "+x", "-x" }, 31, 9 }, { { "+y", "-y" }, 41.5, 7 } } do
  local side = packaging.label { on = face[1], out = face[2] }
  side.text("COOKIES", 0, 9.5, face[3], CREAM, { weight = 0.2 })
  table.move(side.layers, 1, #side.layers, #layers + 1, layers)
end

return softvt.asset {
  name = "cookies",
  shape = packaging.carton(62, 83, 19),
  body = softvt.rigid { density = 100 },
  visuals = { { albedo = RED, roughness = 0.36, layers = layers } },
}
