-- A carton of orange juice with a slanted top and a screw cap, 53 × 53 × 131 mm.
--
-- 37 g, as in LIBERO (100 kg/m³ of the box around it).
local packaging = require "packaging"

local ORANGE, RIND, CREAM, GREEN =
  { 0.86, 0.25, 0.012 }, { 0.80, 0.20, 0.008 }, { 0.90, 0.84, 0.66 }, { 0.03, 0.26, 0.035 }
local mm = 1e-3

-- The top falls towards +x; the cap stands square on the middle of it.
local HIGH, LOW, HALF = 124, 104, 26.5
local slope = math.atan(HIGH - LOW, 2 * HALF)
local carton = packaging.extrude({ { -HALF, 0 }, { HALF, 0 }, { HALF, LOW }, { -HALF, HIGH } }, 2 * HALF)
local cap = packaging
  .revolve { { 0, -3 }, { 11, -3 }, { 11, 14.019 }, { 0, 14.019 } }
  :rotate { axis = "y", angle = slope }
  :translate(0, 0, (HIGH + LOW) / 2 * mm)

-- A slice of an orange on cream.
local label = packaging.label { on = { "+x", "-x", "+y", "-y" }, out = HALF }
label.belt(10, 58, CREAM)
label.belt(5, 7, CREAM)
label.oval(0, 34, 43, 43, RIND)
label.oval(0, 34, 38.5, 38.5, CREAM)
label.oval(0, 34, 35, 35, { 0.90, 0.36, 0.03 })
for i = 0, 3 do
  label.bar(0, 34, 37, 1.3, CREAM, { lean = i * math.pi / 4 + 0.2 })
end
label.oval(0, 34, 5, 5, CREAM)
label.leaf(17, 55, 15, 0.6, GREEN)
label.text("ORANGE", 0, 80.5, 6.7, CREAM, { weight = 0.2 })
label.text("JUICE", 0, 69, 6.7, CREAM, { weight = 0.2 })
label.text("SUNNY GROVE", 0, 92, 3.8, CREAM, { weight = 0.14 })

return softvt.asset {
  name = "orange_juice",
  shape = carton:union(cap:paint { material = 1 }),
  body = softvt.rigid { density = 113.0 },
  -- The lowest grasp that the palm, 39 mm above the tool centre, allows.
  hints = { grasp_height_m = 95 * mm },
  visuals = {
    { albedo = ORANGE, roughness = 0.38, layers = label.layers },
    { albedo = GREEN, roughness = 0.35 },
  },
}
