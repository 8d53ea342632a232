-- A spiral pastry with ridged frosting, 58 × 47 × 40 mm: a low drum wound up like a snail, its side pleated by the
-- paper case, white frosting piped on top along the spiral.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 58 * mm, 47 * mm, 40 * mm

-- The spiral and the pleats add their height to the drum. The part below the table top is cut off, so that it lies
-- flat.
local SPIRAL, PLEAT, EDGE, BELOW = 2 * mm, 1.2 * mm, 11 * mm, 2 * mm
local radius, height = LENGTH / 2 - PLEAT, HEIGHT - SPIRAL + BELOW
local drum = softvt.shape
  .cylinder { radius = radius - EDGE, height = height - 2 * EDGE }
  :round(EDGE)
  :translate(0, 0, height / 2 - BELOW)
local oval = drum:scale(1, (WIDTH / 2 - 0.8 * mm) / radius, 1)
local table_top = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:translate(0, 0, -0.01)

local spiral = {
  axis = "z",
  count = 1,
  radial_pitch = 8 * mm,
  height = SPIRAL,
  mask = { axis = "z", from = 28 * mm, to = 35 * mm },
}
local pleats = { axis = "z", count = 14, height = PLEAT / 0.8, mask = { axis = "z", from = 31 * mm, to = 26 * mm } }

-- Frosting on the raised spiral; dough in its groove and below.
local upper = softvt.shape.box { size = { 0.1, 0.1, 0.04 } }:translate(0, 0, 0.049)
local groove = oval:round(0.7 * mm):intersect(upper)

-- The paper case: greaseproof, browned a little where it met the tin.
local case = {
  albedo = { 0.78, 0.71, 0.58 },
  roughness = 0.72,
  layers = {
    {
      mask = softvt.mask.gradient { from_m = 12 * mm, to_m = 1 * mm },
      albedo = { 0.60, 0.42, 0.22 },
      roughness = 0.6,
      opacity = 0.7,
    },
    {
      mask = softvt.mask.noise { size_m = { 8 * mm, 8 * mm, 20 * mm }, from = 0.45, to = 0.8, seed = 73 },
      albedo = { 0.66, 0.52, 0.33 },
      roughness = 0.6,
      opacity = 0.4,
    },
  },
}

return softvt.asset {
  name = "spiral_roll",
  shape = oval
    :ridges(spiral)
    :ridges(pleats)
    :subtract(table_top)
    :paint { material = 1, region = upper }
    :paint { material = 2, region = groove },
  body = softvt.soft {
    youngs_pa = 60e3,
    poisson = 0.35,
    density = 240,
    loss_factor = 0.20,
    collapse_strain = 0.10,
    damage_strain = 0.25,
  },
  hints = { grasp_height_m = 20 * mm },
  visuals = {
    case,
    material.frosting { seed = 71 },
    material.crust {
      base = { 0.56, 0.33, 0.135 },
      top = { 0.42, 0.20, 0.06 },
      foot = { 0.60, 0.38, 0.17 },
      sheen = 0.4,
      seed = 72,
    },
  },
}
