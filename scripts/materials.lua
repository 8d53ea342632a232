-- Visual materials: each function returns one entry of an asset's `visuals`. Colours are linear RGB; all arguments are
-- optional.
--
--   local material = require "materials"
--   visuals = { material.ceramic {}, material.crust { top = { 0.5, 0.2, 0.04 } } }
local mask = softvt.mask
local mm = 1e-3

local material = {}

local function layer(where, albedo, roughness, opacity, relief_m)
  return { mask = where, albedo = albedo, roughness = roughness, opacity = opacity or 1, relief_m = relief_m or 0 }
end

-- Fine surface roughness, visual only.
local function pores(size, depth, seed, base)
  return layer(mask.noise { size_m = size, octaves = 2, from = 0.3, to = 0.7, seed = seed }, base, 0.5, 0, depth)
end

-- A baked crust: pale at the bottom, brown at the top, with dark blisters. `sheen` is the roughness of the egg wash.
function material.crust(o)
  local base, top = o.base or { 0.66, 0.36, 0.11 }, o.top or { 0.40, 0.16, 0.035 }
  local foot, sheen, seed = o.foot or { 0.80, 0.58, 0.30 }, o.sheen or 0.36, o.seed or 1
  local rise = o.rise_m or 14 * mm
  return {
    albedo = base,
    roughness = sheen,
    layers = {
      layer(mask.facing { from = 0.25, to = 0.98 }, top, sheen, o.browning or 0.65),
      layer(mask.noise { size_m = 14 * mm, octaves = 4, from = 0.42, to = 0.85, seed = seed }, top, sheen + 0.06, 0.5),
      layer(
        mask.noise { size_m = 9 * mm, octaves = 3, from = 0.50, to = 0.20, seed = seed + 7 },
        foot,
        sheen + 0.1,
        0.22
      ),
      layer(mask.gradient { from_m = rise, to_m = 0.15 * rise }, foot, 0.62, 0.75),
      pores(2.6 * mm, 0.15 * mm, seed + 3, base),
    },
  }
end

-- Steamed dough: pale, matt, with a soft sheen and a moist foot.
function material.dough(o)
  local base, foot, seed = o.base or { 0.83, 0.755, 0.60 }, o.foot or { 0.70, 0.54, 0.32 }, o.seed or 1
  return {
    albedo = base,
    roughness = 0.52,
    layers = {
      layer(mask.noise { size_m = 11 * mm, octaves = 4, from = 0.45, to = 0.8, seed = seed }, foot, 0.5, 0.22),
      layer(mask.facing { from = 0.5, to = 1 }, { 0.88, 0.83, 0.72 }, 0.42, 0.5),
      layer(mask.gradient { from_m = 9 * mm, to_m = 0.5 * mm }, foot, 0.45, 0.55),
      pores(3.2 * mm, 0.16 * mm, seed + 3, base),
    },
  }
end

-- Sugar frosting that has just set: white and wet.
function material.frosting(o)
  local base, seed = o.base or { 0.90, 0.885, 0.85 }, o.seed or 1
  return {
    albedo = base,
    roughness = 0.24,
    layers = {
      layer(
        mask.noise { size_m = 6 * mm, octaves = 3, from = 0.5, to = 0.8, seed = seed },
        { 0.80, 0.74, 0.64 },
        0.34,
        0.35
      ),
      pores(4 * mm, 0.25 * mm, seed + 3, base),
    },
  }
end

-- Sesame: cream seeds, each a little different.
function material.seeds(o)
  local base, seed = o.base or { 0.86, 0.74, 0.50 }, o.seed or 1
  return {
    albedo = base,
    roughness = 0.42,
    layers = {
      layer(
        mask.noise { size_m = 5 * mm, octaves = 2, from = 0.42, to = 0.62, seed = seed },
        { 0.70, 0.50, 0.25 },
        0.45,
        0.6
      ),
    },
  }
end

-- Flour on upward-facing surfaces, on top of another material.
function material.floured(look, o)
  local dust = mask.noise { size_m = o.size_m or 3 * mm, octaves = 3, from = 0.5, to = 0.8, seed = o.seed or 1 }
  look.layers = look.layers or {}
  table.insert(
    look.layers,
    layer(dust:intersect(mask.facing { from = 0.35, to = 0.85 }), { 0.78, 0.70, 0.58 }, 0.95, o.opacity or 0.5)
  )
  return look
end

-- Foam rubber: one colour, matt, full of fine cells.
function material.foam(o)
  local base, seed = o.base or { 0.10, 0.33, 0.60 }, o.seed or 1
  local deep = { base[1] * 0.62, base[2] * 0.62, base[3] * 0.62 }
  local worn = { 0.75 * base[1] + 0.2, 0.75 * base[2] + 0.2, 0.75 * base[3] + 0.2 }
  return {
    albedo = base,
    roughness = 0.85,
    layers = {
      layer(mask.noise { size_m = 16 * mm, octaves = 3, from = 0.4, to = 0.8, seed = seed }, worn, 0.88, 0.12),
      layer(mask.specks { spacing_m = 2.2 * mm, radius_m = 0.55 * mm, seed = seed + 1 }, deep, 0.95, 0.75, -0.18 * mm),
      layer(mask.specks { spacing_m = 3.7 * mm, radius_m = 0.8 * mm, seed = seed + 2 }, deep, 0.95, 0.6, -0.22 * mm),
      pores(1.6 * mm, 0.10 * mm, seed + 3, base),
    },
  }
end

-- Cast silicone: one colour, satin, with a faint orange peel and finger marks.
function material.silicone(o)
  local base, seed = o.base or { 0.78, 0.45, 0.05 }, o.seed or 1
  local pale = { 0.9 * base[1] + 0.09, 0.9 * base[2] + 0.09, 0.9 * base[3] + 0.09 }
  local deep = { base[1] * 0.85, base[2] * 0.85, base[3] * 0.85 }
  return {
    albedo = base,
    roughness = 0.38,
    layers = {
      layer(mask.noise { size_m = 22 * mm, octaves = 3, from = 0.45, to = 0.8, seed = seed }, pale, 0.46, 0.4),
      layer(mask.noise { size_m = 9 * mm, octaves = 3, from = 0.5, to = 0.85, seed = seed + 1 }, deep, 0.34, 0.4),
      pores(1.6 * mm, 0.06 * mm, seed + 3, base),
    },
  }
end

-- Glazed stoneware.
function material.ceramic(o)
  local base, seed = o.base or { 0.78, 0.77, 0.73 }, o.seed or 1
  return {
    albedo = base,
    roughness = o.roughness or 0.24,
    layers = {
      layer(
        mask.noise { size_m = 40 * mm, octaves = 4, from = 0.4, to = 0.8, seed = seed },
        o.shade or { 0.70, 0.67, 0.60 },
        0.28,
        0.4
      ),
    },
  }
end

-- Oiled boards that lie along x.
function material.wood(o)
  local base, dark, seed = o.base or { 0.43, 0.295, 0.175 }, o.dark or { 0.27, 0.165, 0.085 }, o.seed or 1
  local length, width = o.length_m or 0.9, o.width_m or 0.13
  return {
    albedo = base,
    roughness = 0.46,
    layers = {
      layer(
        mask.boards { length_m = length, width_m = width, seed = seed },
        o.light or { 0.52, 0.385, 0.25 },
        0.50,
        0.7
      ),
      layer(
        mask.noise { size_m = { 0.30, 9 * mm, 9 * mm }, octaves = 4, from = 0.36, to = 0.92, seed = seed + 1 },
        dark,
        0.52,
        0.50
      ),
      layer(
        mask.noise { size_m = { 0.07, 3 * mm, 3 * mm }, octaves = 2, from = 0.5, to = 0.95, seed = seed + 2 },
        dark,
        0.60,
        0.4
      ),
      layer(mask.seams { length_m = length, width_m = width, gap_m = 1.4 * mm }, { 0.05, 0.027, 0.014 }, 0.8, 0.85),
    },
  }
end

-- The boards of the room's floor: dark, wide and long.
function material.floorboards()
  return material.wood {
    base = { 0.150, 0.120, 0.095 },
    dark = { 0.075, 0.058, 0.046 },
    light = { 0.20, 0.165, 0.13 },
    length_m = 1.6,
    width_m = 0.19,
    seed = 21,
  }
end

-- Brushed steel; `along` is the direction of the brush.
function material.steel(o)
  local fine, long = 2 * mm, 80 * mm
  local size = ({ x = { long, fine, fine }, y = { fine, long, fine }, z = { fine, fine, long } })[o.along or "x"]
  return {
    albedo = o.base or { 0.72, 0.73, 0.74 },
    roughness = o.roughness or 0.30,
    metalness = 1,
    layers = {
      layer(
        mask.noise { size_m = size, octaves = 2, from = 0.3, to = 0.7, seed = o.seed or 1 },
        { 0.50, 0.51, 0.52 },
        0.42,
        0.7
      ),
    },
  }
end

-- Woven cloth; the threads lie along x and y.
function material.fabric(o)
  local base, thread = o.base or { 0.34, 0.31, 0.26 }, o.thread or { 0.70, 0.66, 0.58 }
  return {
    albedo = base,
    roughness = 0.92,
    layers = {
      layer(mask.weave { pitch_m = o.pitch_m or 2.4 * mm }, thread, 0.95, 0.9, 0.1 * mm),
      layer(mask.noise { size_m = 30 * mm, octaves = 3, from = 0.4, to = 0.8, seed = o.seed or 1 }, base, 0.95, 0.4),
    },
  }
end

-- Paint on plaster or boards, with slight variations of colour.
function material.paint(o)
  local base, seed = o.base or { 0.30, 0.33, 0.33 }, o.seed or 1
  local worn = o.worn or { base[1] * 0.82, base[2] * 0.82, base[3] * 0.82 }
  local layers = {
    layer(mask.noise { size_m = o.size_m or 0.4, octaves = 4, from = 0.35, to = 0.8, seed = seed }, worn, 0.75, 0.5),
  }
  for _, more in ipairs(o.layers or {}) do
    layers[#layers + 1] = more
  end
  return { albedo = base, roughness = o.roughness or 0.65, layers = layers }
end

return material
