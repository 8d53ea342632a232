-- A croissant, 95 × 46 × 36 mm: a crescent of rolled segments that get smaller towards the horns, striped with
-- chocolate dough.
local material = require "materials"

local mm = 1e-3
-- The middle line is an arc of this radius, mm; it is moved so that the whole lies around the z axis.
local ARC, FORWARD = 52.5, 3.2
local TABLE_TOP = softvt.shape.box { size = { 0.2, 0.2, 0.02 } }:translate(0, 0, -0.01)

-- Puts a shape at arc length `s` (mm), turned with the arc.
local function along(shape, s, z)
  local angle = s / ARC
  local x, y = ARC * math.sin(angle), ARC * (math.cos(angle) - 1) + FORWARD
  return shape:rotate { axis = "z", angle = -angle }:translate(x * mm, y * mm, z * mm)
end

-- Segments: place along the arc, length, width, height over the table (mm). Each overlaps the next, which is smaller.
local SEGMENTS = {
  { 0, 34, 39.6, 36 },
  { 14.5, 28, 35, 32.5 },
  { 27, 24, 28, 26.5 },
  { 37.8, 20, 20, 20 },
  { 46.7, 15.2, 12, 13.5 },
}
local BELOW = 4

local pastry, stripes
local function add(s, length, width, height)
  local segment = softvt.shape.ellipsoid { size = { length * mm, width * mm, (height + BELOW) * mm } }
  local placed = along(segment, s, (height - BELOW) / 2)
  pastry = pastry and pastry:smooth_union(placed, 1.6 * mm) or placed
  local stripe = along(softvt.shape.box { size = { 0.28 * length * mm, 0.08, 0.08 } }, s, 0)
  stripes = stripes and stripes:union(stripe) or stripe
end
for _, segment in ipairs(SEGMENTS) do
  local s, length, width, height = table.unpack(segment)
  add(s, length, width, height)
  if s > 0 then add(-s, length, width, height) end
end

local crust = material.crust {
  base = { 0.78, 0.47, 0.14 },
  top = { 0.66, 0.32, 0.06 },
  browning = 0.6,
  foot = { 0.80, 0.53, 0.22 },
  sheen = 0.28,
  rise_m = 9 * mm,
  seed = 21,
}
table.insert(crust.layers, {
  mask = softvt.mask.inside { shape = stripes, soft_m = 4 * mm },
  albedo = { 0.27, 0.085, 0.014 },
  roughness = 0.26,
  opacity = 0.9,
})

return softvt.asset {
  name = "croissant",
  shape = pastry:subtract(TABLE_TOP, 2.5 * mm),
  -- It is 5.0 voxels wide in the middle; with the usual six along its length it would be 2.5.
  body = softvt.soft {
    youngs_pa = 160e3,
    poisson = 0.36,
    density = 260,
    loss_factor = 0.15,
    resolution = 12,
    collapse_strain = 0.08,
    damage_strain = 0.10,
  },
  hints = { grasp_height_m = 20.5 * mm },
  visuals = { crust },
}
