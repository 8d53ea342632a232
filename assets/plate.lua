-- A stoneware plate, 138 mm across and 19 mm high, as one solid of revolution.
--
-- The well is wide and lies high in the plate, so that the sensors' cases, which reach 16 mm below the finger tips and
-- 29 mm behind the gels, clear the rim when an object is set down. The rim is 4 mm thick at its edge: thinner walls could
-- be crossed by a fast soft body.
local mm = 1e-3

local function profile(corners)
  for _, corner in ipairs(corners) do corner[1], corner[2] = corner[1] * mm, corner[2] * mm end
  return softvt.shape.lathe { corners = corners }
end

local body = profile {
  { 0, 0 }, { 42, 0 }, { 46, 3 }, { 69, 14.5 }, { 69, 18 }, { 68, 19 }, { 64, 19 }, { 58, 14.2 }, { 56, 13.5 }, { 0, 13.5 },
}

return softvt.asset {
  name = "plate",
  shape = body:paint {
    material = 1,
    region = softvt.shape.torus { major = 67 * mm, minor = 3 * mm }:translate(0, 0, 18 * mm),
  },
  body = softvt.static {},
  hints = { surface_m = 13.5 * mm },
  visuals = {
    { albedo = { 0.82, 0.84, 0.84 }, roughness = 0.25 },
    { albedo = { 0.12, 0.25, 0.45 }, roughness = 0.25 },
  },
}
