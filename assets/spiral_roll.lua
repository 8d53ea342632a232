-- A spiral pastry with ridged frosting, 58 × 47 × 40 mm: a low drum wound up like a snail, its side pleated by the paper
-- case, white frosting piped on top along the spiral.
local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 58 * mm, 47 * mm, 40 * mm

-- The spiral and the pleats stand on the drum and add their height to it; below the table top it is cut off, pleats and
-- all, so that it lies flat.
local SPIRAL, PLEAT, EDGE, BELOW = 2 * mm, 1.2 * mm, 11 * mm, 2 * mm
local radius, height = LENGTH / 2 - PLEAT, HEIGHT - SPIRAL + BELOW
local drum = softvt.shape.cylinder { radius = radius - EDGE, height = height - 2 * EDGE }
  :round(EDGE):translate(0, 0, height / 2 - BELOW)
local oval = drum:scale(1, (WIDTH / 2 - PLEAT) / radius, 1)
local table_top = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:translate(0, 0, -0.01)

local spiral = {
  axis = "z", count = 1, radial_pitch = 8 * mm, height = SPIRAL, mask = { axis = "z", from = 28 * mm, to = 35 * mm },
}
local pleats = { axis = "z", count = 22, height = PLEAT, mask = { axis = "z", from = 31 * mm, to = 26 * mm } }

-- Frosting where the spiral stands out of the drum; dough in its groove and below.
local upper = softvt.shape.box { size = { 0.1, 0.1, 0.04 } }:translate(0, 0, 0.049)
local groove = oval:round(0.7 * mm):intersect(upper)

return softvt.asset {
  name = "spiral_roll",
  shape = oval:ridges(spiral):ridges(pleats):subtract(table_top)
    :paint { material = 1, region = upper }:paint { material = 2, region = groove },
  body = softvt.soft { youngs_pa = 60e3, poisson = 0.35, density = 240 },
  visuals = {
    { albedo = { 0.86, 0.80, 0.70 }, roughness = 0.8 },
    { albedo = { 0.93, 0.92, 0.88 }, roughness = 0.4 },
    { albedo = { 0.62, 0.44, 0.26 }, roughness = 0.7 },
  },
}
