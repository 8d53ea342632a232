-- Shapes of packages, with dimensions in mm, and printed labels.
--
--   local packaging = require "packaging"
--   local label = packaging.label { on = { "+y", "-y" }, out = 18 }
--   label.oval(0, 50, 30, 44, { 0.9, 0.8, 0.6 })
--   label.text("KETCHUP", 0, 60, 6, { 0.5, 0.02, 0.02 })
--   visuals = { { albedo = { 0.5, 0.02, 0.02 }, layers = label.layers } }
local mask = softvt.mask
local mm = 1e-3

local packaging = {}

-- A solid of revolution of the polygon with corners (r, z), mm.
function packaging.revolve(corners)
  local metres = {}
  for i, corner in ipairs(corners) do
    metres[i] = { corner[1] * mm, corner[2] * mm }
  end
  return softvt.shape.lathe { corners = metres }
end

-- The polygon with corners (x, z), mm, extruded along y.
function packaging.extrude(corners, length)
  local metres = {}
  for i, corner in ipairs(corners) do
    metres[i] = { corner[1] * mm, corner[2] * mm }
  end
  return softvt.shape.prism { corners = metres, length = length * mm }
end

-- A cardboard box, mm, with its lowest face at z = 0.
function packaging.carton(x, y, z)
  return softvt.shape.box { size = { x * mm, y * mm, z * mm } }:translate(0, 0, z / 2 * mm)
end

-- The region between two heights, mm.
function packaging.band(from, to)
  return softvt.shape.box { size = { 1, 1, (to - from) * mm } }:translate(0, 0, (from + to) / 2 * mm)
end

-- A can with seams, 62 mm across and 76 mm high. Material 0 is the metal, 1 the label.
function packaging.can()
  local tin = packaging.revolve {
    { 0, 0 },
    { 30, 0 },
    { 31, 0.8 },
    { 31, 2.6 },
    { 30.2, 3.4 },
    { 30.2, 72.6 },
    { 31, 73.4 },
    { 31, 75.2 },
    { 30.2, 76 },
    { 29.2, 76 },
    { 28.4, 74 },
    { 0, 74 },
  }
  return tin:paint { material = 1, region = packaging.band(3.8, 72.2) }
end

-- Orientation of each face's label in the object: rotations about x, then z. In the label's frame x points to the
-- reader's right, y up and z outwards.
local HALF = math.pi / 2
local FACES = {
  ["-y"] = { HALF, 0 },
  ["+x"] = { HALF, HALF },
  ["+y"] = { HALF, math.pi },
  ["-x"] = { HALF, -HALF },
  ["+z"] = { 0, 0 },
}

local function onto(shape, face)
  local tip, turn = table.unpack(FACES[face])
  return shape:rotate { axis = "x", angle = tip }:rotate { axis = "z", angle = turn }
end

-- Transforms a point of a label (mm) to the object frame.
local function point(x, y, z, face)
  if face == "+z" then return { x * mm, y * mm, z * mm } end
  local turn = FACES[face][2]
  local cos, sin = math.cos(turn), math.sin(turn)
  return { (x * cos + z * sin) * mm, (x * sin - z * cos) * mm, y * mm }
end

-- A label: the same print on each of the faces `on`, named by their outward direction ("+z" is the top). Positions are
-- in mm to the reader's right and up from the object's origin; `out` is the distance of the faces from it, `turn`
-- rotates the print. On round objects, `round` is the inner limit of motifs; with `wrap`, a radius in mm, text runs
-- around the z axis.
function packaging.label(spec)
  local label = { layers = {} }
  local out, turn = spec.out, spec.turn or 0
  local inner = spec.round or out - 0.5

  -- Adds a layer on top.
  function label.ink(where, albedo, more)
    more = more or {}
    table.insert(
      label.layers,
      { mask = where, albedo = albedo, roughness = more.roughness or 0.42, opacity = more.opacity or 1 }
    )
  end

  -- A motif: a shape in the label's frame.
  function label.motif(shape, x, y, albedo, more)
    local all
    for _, face in ipairs(spec.on) do
      local here = shape:translate(x * mm, y * mm, (inner + 100) * mm):rotate { axis = "z", angle = turn }
      here = onto(here, face)
      all = all and all:union(here) or here
    end
    label.ink(mask.inside { shape = all, soft_m = more and more.soft and more.soft * mm or 0 }, albedo, more)
  end

  function label.bar(x, y, wide, high, albedo, more)
    local shape = softvt.shape.box { size = { wide * mm, high * mm, 0.2 } }
    label.motif(more and more.lean and shape:rotate { axis = "z", angle = more.lean } or shape, x, y, albedo, more)
  end

  function label.oval(x, y, wide, high, albedo, more)
    local shape = softvt.shape.cylinder { radius = wide / 2 * mm, height = 0.2 }
    if high ~= wide then shape = shape:scale(1, high / wide, 1) end
    label.motif(more and more.lean and shape:rotate { axis = "z", angle = more.lean } or shape, x, y, albedo, more)
  end

  -- A leaf: the intersection of two discs.
  function label.leaf(x, y, long, lean, albedo)
    local disc = softvt.shape.cylinder { radius = 0.72 * long * mm, height = 0.2 }
    local leaf = disc:translate(0, 0.52 * long * mm, 0):intersect(disc:translate(0, -0.52 * long * mm, 0))
    label.motif(leaf:rotate { axis = "z", angle = lean }, x, y, albedo)
  end

  -- A polygon from corners (x, y) in mm.
  function label.polygon(x, y, corners, albedo)
    label.motif(packaging.extrude(corners, 200):rotate { axis = "x", angle = -HALF }, x, y, albedo)
  end

  -- A line of text centred at (x, y) with capitals of height `high`, mm.
  function label.text(words, x, y, high, albedo, more)
    more = more or {}
    for _, face in ipairs(spec.on) do
      local cos, sin = math.cos(turn), math.sin(turn)
      local at = point(x * cos - y * sin, x * sin + y * cos, out, face)
      local facing = face
      if spec.wrap then
        local way = FACES[face][2] - HALF + x / spec.wrap
        facing, at = { math.cos(way), math.sin(way), 0 }, { 0, 0, y * mm }
      end
      label.ink(
        mask.text {
          text = words,
          height_m = high * mm,
          at = at,
          facing = facing,
          angle = turn + (more.lean or 0),
          wrap_m = spec.wrap and spec.wrap * mm or nil,
          weight = more.weight or 0.14,
          font = more.font,
        },
        albedo,
        more
      )
    end
  end

  -- A belt around the object between two heights, mm.
  function label.belt(from, to, albedo, more) label.ink(mask.inside { shape = packaging.band(from, to) }, albedo, more) end

  return label
end

return packaging
