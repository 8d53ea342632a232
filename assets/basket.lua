-- A basket of wicker, 170 × 157 × 142 mm; inside 132 × 143 mm, with a bar to carry it by on either end.
--
-- Its sides are low, because a hand with its sensors is 205 mm wide: full walls would stop it 80 mm above the floor of
-- the basket. Over the low sides it can place flat objects.
--
-- 379 g, as in LIBERO (100 kg/m³ of the box around it). Its walls are 7 and 8 mm thick and smooth; the weave is a
-- visual material.
local packaging = require "packaging"

local mask = softvt.mask
local mm = 1e-3
local WILLOW, PALE, BARK, GAP =
  { 0.47, 0.26, 0.10 }, { 0.64, 0.41, 0.185 }, { 0.22, 0.10, 0.034 }, { 0.045, 0.019, 0.007 }

local function slab(x, y, z, at)
  return softvt.shape.box { size = { x * mm, y * mm, z * mm } }:translate(at[1] * mm, at[2] * mm, at[3] * mm)
end

local function rod(axis, radius, length, at)
  local turns =
    { x = { axis = "y", angle = math.pi / 2 }, y = { axis = "x", angle = math.pi / 2 }, z = { axis = "z", angle = 0 } }
  return softvt.shape
    .cylinder { radius = radius * mm, height = length * mm }
    :rotate(turns[axis])
    :translate(at[1] * mm, at[2] * mm, at[3] * mm)
end

-- A floor of 6 mm, ends of full height with a bar each, and low sides; rods around all rims.
local shape, rods = slab(140, 150, 6, { 0, 0, 3 }), nil
local function rim(part) rods = rods and rods:union(part) or part end
for _, side in ipairs { -1, 1 } do
  shape = shape:union(slab(8, 150, 124, { side * 70, 0, 62 })):union(slab(140, 7, 64, { 0, side * 75, 32 }))
  rim(rod("y", 6.5, 150, { side * 72.5, 0, 124 }))
  rim(rod("x", 4.5, 140, { 0, side * 74, 66 }))
  rim(rod("y", 3.5, 74, { side * 81.5, 0, 138.5 }))
  for _, y in ipairs { -28, 28 } do
    rim(rod("z", 3.5, 18, { side * 80, y, 131 }))
  end
end

-- Layers of the visual material.
local layers = {}
local function lay(where, albedo, opacity)
  table.insert(layers, { mask = where, albedo = albedo, roughness = 0.6, opacity = opacity or 1 })
end
local function all(first, ...)
  for _, more in ipairs { ... } do
    first = first:intersect(more)
  end
  return first
end
local function stripes(axis, pitch, share) return mask.stripes { axis = axis, pitch_m = pitch, share = share } end
-- The middle of each stripe.
local function middle(axis, pitch, from, to)
  return stripes(axis, pitch, to):intersect(stripes(axis, pitch, from):inverted())
end

-- Weavers run around, in front of one stake and behind the next, in the row above the other way round; both are round,
-- so they are dark at their sides.
local STAKE, WEAVER = 12 * mm, 7 * mm
local row = stripes("z", 2 * WEAVER, 0.5)
lay(mask.noise { size_m = { 30 * mm, 30 * mm, 3 * mm }, octaves = 3, from = 0.35, to = 0.75, seed = 8 }, PALE, 0.8)
lay(middle("z", WEAVER, 0.28, 0.86):inverted(), BARK, 0.55)
lay(middle("z", WEAVER, 0.12, 1):inverted(), GAP, 0.9)
for _, wall in ipairs { { out = "y", across = "x" }, { out = "x", across = "y" } } do
  local column, across = stripes(wall.across, 2 * STAKE, 0.5), wall.across
  local cells = { column:intersect(row), column:inverted():intersect(row:inverted()) }
  for _, cell in ipairs(cells) do
    for _, sign in ipairs { -1, 1 } do
      local outwards = { wall.out == "x" and sign or 0, wall.out == "y" and sign or 0, 0 }
      local here = cell:intersect(mask.facing { axis = outwards, from = 0.8, to = 0.81 })
      lay(here, GAP, 0.85)
      lay(here:intersect(middle(across, STAKE, 0.16, 0.84)), BARK)
      lay(here:intersect(middle(across, STAKE, 0.26, 0.74)), WILLOW)
      lay(here:intersect(middle(across, STAKE, 0.38, 0.56)), PALE, 0.7)
    end
  end
end

-- Willow wound around the rods, and a tag on the front and the back.
local wound = mask.inside { shape = rods, soft_m = 1 * mm }
lay(wound, WILLOW)
lay(wound:intersect(mask.noise { size_m = 6 * mm, octaves = 3, from = 0.35, to = 0.75, seed = 9 }), PALE, 0.8)
lay(wound:intersect(middle({ 1, 1, 0.8 }, 6 * mm, 0.30, 0.84):inverted()), BARK, 0.5)
lay(wound:intersect(middle({ 1, 1, 0.8 }, 6 * mm, 0.14, 1):inverted()), GAP, 0.85)
local tag = packaging.label { on = { "+x", "-x" }, out = 74 }
tag.bar(0, 84, 54, 22, { 0.10, 0.042, 0.016 })
tag.bar(0, 84, 52.6, 20.6, { 0.60, 0.46, 0.27 })
tag.text("PICNIC", 0, 86, 8, { 0.10, 0.042, 0.016 }, { weight = 0.2 })
tag.text("hand woven", 0, 77.4, 3, { 0.10, 0.042, 0.016 })
for _, x in ipairs { -23.5, 23.5 } do
  tag.oval(x, 84, 2.4, 2.4, GAP)
end
table.move(tag.layers, 1, #tag.layers, #layers + 1, layers)

return softvt.asset {
  name = "basket",
  shape = shape:union(rods),
  body = softvt.rigid { density = 670 },
  hints = { surface_m = 6 * mm, wall_m = 14 * mm },
  visuals = { { albedo = WILLOW, roughness = 0.6, layers = layers } },
}
