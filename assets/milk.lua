-- A carton of milk with a gable top, 53 × 53 × 131 mm.
--
-- 37 g, as in LIBERO (100 kg/m³ of the box around it).
local mm = 1e-3

-- The gable seen along y: the roof rises to a fin.
local gable = {}
for i, corner in ipairs {
  { -26.5, 0 }, { 26.5, 0 }, { 26.5, 94 }, { 2.2, 120 }, { 2.2, 131 }, { -2.2, 131 }, { -2.2, 120 }, { -26.5, 94 },
} do
  gable[i] = { corner[1] * mm, corner[2] * mm }
end

return softvt.asset {
  name = "milk",
  shape = softvt.shape.prism { corners = gable, length = 53 * mm },
  body = softvt.rigid { density = 120.2 },
  visuals = { { albedo = { 0.8, 0.8, 0.85 } } },
}
