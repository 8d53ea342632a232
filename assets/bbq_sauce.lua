-- A flat bottle of barbecue sauce, 47 × 29 × 107 mm.
--
-- 15 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local mm = 1e-3
local SAUCE, BLACK, CREAM = { 0.085, 0.017, 0.006 }, { 0.014, 0.012, 0.011 }, { 0.90, 0.80, 0.60 }
local EMBER, FLAME, SPARK = { 0.56, 0.045, 0.008 }, { 0.82, 0.22, 0.012 }, { 0.92, 0.60, 0.06 }

local glass = packaging
  .revolve {
    { 0, 0 },
    { 23.5, 0 },
    { 23.5, 73 },
    { 22.5, 77 },
    { 19, 83 },
    { 14.5, 87 },
    { 13, 91 },
    { 0, 91 },
  }
  :scale(1, 29 / 47, 1)
local cap = packaging.revolve { { 0, 88 }, { 10, 88 }, { 10, 106 }, { 9, 107 }, { 0, 107 } }:paint { material = 1 }

-- Flames on a black label. A tongue leans and tapers to its tip.
local label = packaging.label { on = { "+y", "-y" }, out = 14, round = 2 }
label.belt(7, 64, CREAM)
label.belt(8, 63, BLACK)
local function tongue(x, wide, high, colour)
  label.polygon(x, 8, {
    { -0.5 * wide, 0 },
    { 0.5 * wide, 0 },
    { 0.46 * wide, 0.34 * high },
    { 0.22 * wide, 0.62 * high },
    { 0.16 * wide, high },
    { -0.16 * wide, 0.72 * high },
    { -0.44 * wide, 0.36 * high },
  }, colour)
end
for i, colour in ipairs { EMBER, FLAME, SPARK } do
  local share = 1.24 - 0.24 * i
  tongue(-14, 12 * share, 19 * share, colour)
  tongue(-5, 13 * share, 25 * share, colour)
  tongue(5, 13 * share, 21 * share, colour)
  tongue(14, 12 * share, 26 * share, colour)
end
label.text("BBQ", 0, 47, 11, CREAM, { weight = 0.24 })
label.text("SMOKY OAK", 0, 57.5, 3.2, FLAME, { weight = 0.18 })
label.text("SAUCE", 0, 36.6, 4, CREAM, { weight = 0.18 })

return softvt.asset {
  name = "bbq_sauce",
  shape = glass:union(cap),
  body = softvt.rigid { density = 152.0 },
  -- The lowest grasp that the palm, 39 mm above the tool centre, allows.
  hints = { grasp_height_m = 70 * mm },
  visuals = { { albedo = SAUCE, roughness = 0.16, layers = label.layers }, { albedo = EMBER, roughness = 0.36 } },
}
