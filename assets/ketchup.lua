-- A squeeze bottle of ketchup, 56 × 37 × 146 mm.
--
-- 30 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local mm = 1e-3
local RED, CREAM, GREEN, DARK =
  { 0.56, 0.016, 0.008 }, { 0.90, 0.82, 0.62 }, { 0.025, 0.19, 0.03 }, { 0.28, 0.008, 0.006 }

local bottle = packaging
  .revolve {
    { 0, 0 },
    { 28, 0 },
    { 28, 44 },
    { 26, 60 },
    { 25, 74 },
    { 25, 110 },
    { 23, 114 },
    { 17, 118 },
    { 16, 120 },
    { 0, 120 },
  }
  :scale(1, 37 / 56, 1)
local cap = packaging
  .revolve {
    { 0, 116 },
    { 14, 116 },
    { 14, 128 },
    { 12.5, 129.5 },
    { 7, 131.5 },
    { 4.6, 134 },
    { 3, 145 },
    { 2.2, 146 },
    { 0, 146 },
  }
  :paint { material = 1 }

-- An arched label: the name in a red ribbon over a tomato.
local label = packaging.label { on = { "+y", "-y" }, out = 18, round = 3 }
label.oval(0, 52, 46, 84, DARK)
label.oval(0, 52, 44, 82, CREAM)
label.oval(0, 35, 26, 24, DARK)
label.oval(0, 35, 24.4, 22.4, RED)
label.oval(-5, 40, 6, 4, { 0.80, 0.25, 0.18 }, { lean = 0.6 })
for i = -2, 2 do
  label.leaf(3 * i, 45.2 - 0.8 * math.abs(i), 8, math.pi / 2 - 0.55 * i, GREEN)
end
label.bar(0, 63, 56, 14, RED)
label.bar(0, 71.2, 56, 0.9, DARK)
label.bar(0, 54.8, 56, 0.9, DARK)
label.text("KETCHUP", 0, 63, 5.9, CREAM, { weight = 0.22 })
label.text("RUBY VINE", 0, 78.5, 3.4, DARK, { weight = 0.18 })
label.text("sun-ripe", 0, 18.5, 3.2, DARK, { weight = 0.14 })

return softvt.asset {
  name = "ketchup",
  shape = bottle:union(cap),
  body = softvt.rigid { density = 170.2 },
  -- The lowest grasp that the palm, 39 mm above the tool centre, allows; the bottle is narrower there than at its foot.
  hints = { grasp_height_m = 109 * mm, grasp_width_m = 33 * mm },
  visuals = {
    { albedo = RED, roughness = 0.26, layers = label.layers },
    { albedo = { 0.86, 0.86, 0.83 }, roughness = 0.36 },
  },
}
