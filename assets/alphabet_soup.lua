-- A tin of alphabet soup, 62 mm across and 76 mm high.
--
-- 29 g, as in LIBERO (100 kg/m³ of the box around it).
local material = require "materials"
local packaging = require "packaging"

local YELLOW, TEAL, RED, WHITE =
  { 0.88, 0.56, 0.045 }, { 0.010, 0.155, 0.175 }, { 0.60, 0.03, 0.02 }, { 0.90, 0.88, 0.80 }

local label = packaging.label { on = { "+x", "-x" }, out = 30.2, wrap = 30.2, round = 8 }
label.belt(44, 66, TEAL)
label.belt(67, 68, TEAL)
label.belt(4, 7, TEAL)
label.text("ALPHABET", 0, 59.5, 6.4, YELLOW, { weight = 0.2 })
label.text("SOUP", 0, 49.5, 5.6, WHITE, { weight = 0.18 })

-- Letters swim all around: one every 40°, in two rows.
local INKS = { RED, TEAL, { 0.05, 0.22, 0.04 }, { 0.36, 0.05, 0.20 } }
local row = packaging.label { on = { "+x" }, out = 30.2, wrap = 30.2, round = 8 }
local step = 2 * math.pi * 30.2 / 18
local WORDS = "SAFETOUCHBGKLMNPRW"
for i = 1, #WORDS do
  local high = i % 2 == 0 and 33 or 18
  local lean = 0.55 * math.sin(2.4 * i)
  row.text(
    WORDS:sub(i, i),
    (i - 1) * step,
    high + 3 * math.sin(1.7 * i),
    11,
    INKS[i % 4 + 1],
    { weight = 0.22, lean = lean }
  )
end
table.move(row.layers, 1, #row.layers, #label.layers + 1, label.layers)

return softvt.asset {
  name = "alphabet_soup",
  shape = packaging.can(),
  body = softvt.rigid { density = 136.9 },
  visuals = { material.steel { along = "x", seed = 12 }, { albedo = YELLOW, roughness = 0.42, layers = label.layers } },
}
