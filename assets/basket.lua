-- A basket of wicker, 170 × 157 × 142 mm; inside 122 × 122 mm.
local mm = 1e-3

local function part(x, y, z, at)
  return softvt.shape.box { size = { x * mm, y * mm, z * mm } }:translate(at[1] * mm, at[2] * mm, at[3] * mm)
end

-- Walls of 8 mm on a floor of 6 mm, a rim around them and a handle on either side.
local shape = part(138, 138, 6, { 0, 0, 3 })
for _, side in ipairs { -1, 1 } do
  shape = shape:union(part(8, 138, 142, { side * 65, 0, 71 })):union(part(122, 8, 142, { 0, side * 65, 71 }))
    :union(part(9.5, 157, 16, { side * 73.75, 0, 132 })):union(part(138, 9.5, 16, { 0, side * 73.75, 132 }))
    :union(part(6.5, 60, 10, { side * 81.75, 0, 131 }))
end

return softvt.asset {
  name = "basket",
  shape = shape,
  body = softvt.rigid { density = 487.5 },
  hints = { surface_m = 6 * mm },
  visuals = { { albedo = { 0.5, 0.3, 0.15 } } },
}
