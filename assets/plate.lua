-- A stoneware plate, 138 mm across and 19 mm high, as one solid of revolution.
--
-- The well is wide and lies high in the plate, so that the sensors' cases, which reach 16 mm below the finger tips and
-- 29 mm behind the gels, clear the rim when an object is set down. The rim is 4 mm thick at its edge: thinner walls
-- could be crossed by a fast soft body. 36 g, as in LIBERO (100 kg/m³ of the box around it).
local material = require "materials"

local mm = 1e-3

local function profile(corners)
  for _, corner in ipairs(corners) do
    corner[1], corner[2] = corner[1] * mm, corner[2] * mm
  end
  return softvt.shape.lathe { corners = corners }
end

local body = profile {
  { 0, 0 },
  { 42, 0 },
  { 46, 3 },
  { 69, 15 },
  { 69, 18 },
  { 68, 19 },
  { 65, 19 },
  { 60, 15.2 },
  { 57, 14.5 },
  { 0, 14.5 },
}

-- A thin second line in the well, as potters draw it on the wheel.
local glazed = material.ceramic { seed = 4 }
table.insert(glazed.layers, {
  mask = softvt.mask.inside {
    shape = softvt.shape.torus { major = 55 * mm, minor = 0.9 * mm }:translate(0, 0, 14.5 * mm),
    soft_m = 0.8 * mm,
  },
  albedo = { 0.14, 0.22, 0.34 },
  roughness = 0.24,
  opacity = 0.85,
})

return softvt.asset {
  name = "plate",
  shape = body:paint {
    material = 1,
    region = softvt.shape.torus { major = 67 * mm, minor = 3 * mm }:translate(0, 0, 18 * mm),
  },
  body = softvt.rigid { density = 241.2 },
  hints = { surface_m = 14.5 * mm },
  visuals = {
    glazed,
    material.ceramic { base = { 0.075, 0.15, 0.27 }, seed = 5 },
  },
}
