-- What packages have in common: their forms, in mm, and the printing on them.
--
-- A print is a list of layers for a look. Faces are named by the direction in which they look: "+y" is the side that faces
-- +y. Text reads upright from outside of it.
local mask = softvt.mask
local mm = 1e-3

local packages = {}

-- A solid of revolution from corners (r, z) in mm.
function packages.turned(corners)
  local metres = {}
  for i, corner in ipairs(corners) do metres[i] = { corner[1] * mm, corner[2] * mm } end
  return softvt.shape.lathe { corners = metres }
end

-- A cardboard box in mm with its lowest face at z = 0.
function packages.carton(x, y, z)
  return softvt.shape.box { size = { x * mm, y * mm, z * mm } }:translate(0, 0, z / 2 * mm)
end

-- A tin can with its beads and its two seams: 62 mm across, 76 mm high.
function packages.can()
  return packages.turned {
    { 0, 0 }, { 30, 0 }, { 31, 0.8 }, { 31, 2.6 }, { 30.2, 3.4 }, { 30.2, 72.6 }, { 31, 73.4 }, { 31, 75.2 }, { 30.2, 76 },
    { 29.2, 76 }, { 28.4, 74 }, { 0, 74 },
  }
end

-- Where a shape is, its border sharp.
function packages.inside(shape) return mask.inside { shape = shape } end

-- Between two heights, mm.
function packages.band(from, to)
  local shape = softvt.shape.box { size = { 1, 1, (to - from) * mm } }
  return packages.inside(shape:translate(0, 0, (from + to) / 2 * mm))
end

-- One print: where, in which colour.
function packages.ink(where, albedo, roughness, opacity)
  return { mask = where, albedo = albedo, roughness = roughness or 0.45, opacity = opacity or 1 }
end

return packages
