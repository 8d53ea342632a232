-- A cup of chocolate pudding, 80 × 46 × 27 mm: an oval tub under a lid of foil.
--
-- 10 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local BROWN, DARK, CREAM, MILKY =
  { 0.115, 0.036, 0.014 }, { 0.045, 0.014, 0.006 }, { 0.90, 0.83, 0.68 }, { 0.36, 0.16, 0.06 }
local tub = packaging
  .revolve {
    { 0, 0 },
    { 32, 0 },
    { 33.5, 1.5 },
    { 37, 22.6 },
    { 39.6, 23.4 },
    { 40, 24.2 },
    { 40, 26.2 },
    { 39.2, 27 },
    { 0, 27 },
  }
  :scale(1, 46 / 80, 1)

-- A dollop of pudding swims on the lid's cream field.
local lid = packaging.label { on = { "+z" }, out = 27 }
lid.oval(0, 0, 75, 41, DARK)
lid.oval(0, 0, 73.4, 39.4, CREAM)
lid.oval(0, -7.5, 46, 14, BROWN)
lid.oval(-2, -5.2, 33, 9, MILKY, { soft = 1.5 })
lid.oval(0, -5.2, 25, 6.4, BROWN)
lid.oval(2, -4, 14, 3.6, MILKY, { soft = 1 })
lid.oval(3, -3.4, 6, 1.8, BROWN)
lid.text("CHOCOLATE", 0, 10.6, 5.2, BROWN, { weight = 0.2 })
lid.text("PUDDING", 0, 3.3, 4.2, BROWN, { weight = 0.16 })

local side = packaging.label { on = { "+y", "-y" }, out = 19, round = 5 }
side.belt(6, 18, CREAM)
side.belt(4.4, 5.2, CREAM)
side.text("PUDDING", 0, 12, 6.4, BROWN, { weight = 0.2 })

return softvt.asset {
  name = "chocolate_pudding",
  shape = tub:paint { material = 1, region = packaging.band(23, 40) },
  body = softvt.rigid { density = 158.4 },
  visuals = {
    { albedo = BROWN, roughness = 0.28, layers = side.layers },
    { albedo = { 0.62, 0.50, 0.36 }, roughness = 0.34, layers = lid.layers },
  },
}
