-- A spiral pastry with ridged frosting, 58 × 47 × 40 mm: a low drum wound up like a snail, its side pleated by the paper
-- case, white frosting piped on top along the spiral.
local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 58 * mm, 47 * mm, 40 * mm

-- A round drum with a domed top; the ridges below add their height to it.
local SIDE, TOP = 1.2 * mm, 2.8 * mm
local radius = LENGTH / 2 - SIDE
local drum = softvt.shape.lathe {
  corners = {
    { 0, 0 }, { radius - 7 * mm, 0 }, { radius - 2 * mm, 3 * mm }, { radius, 9 * mm }, { radius, 20 * mm },
    { radius - 2.5 * mm, 28 * mm }, { radius - 9 * mm, 34.5 * mm }, { radius - 18 * mm, 37 * mm }, { 0, HEIGHT - TOP },
  },
}
local oval = drum:scale(1, (WIDTH / 2 - SIDE) / radius, 1)

local wound = oval
  :ridges { axis = "z", count = 1, radial_pitch = 8 * mm, height = TOP, mask = { axis = "z", from = 27 * mm, to = 33 * mm } }
  :ridges { axis = "z", count = 22, height = SIDE, mask = { axis = "z", from = 31 * mm, to = 25 * mm } }

-- Frosting where the spiral stands out of the drum, dough in its groove and below.
local frosting = softvt.shape.box { size = { 0.1, 0.1, 0.04 } }:translate(0, 0, 0.045)

return softvt.asset {
  name = "spiral_roll",
  shape = wound:paint { material = 1, region = frosting }:paint { material = 2, region = oval:round(0.9 * mm):intersect(frosting) },
  body = softvt.soft { youngs_pa = 60e3, poisson = 0.35, density = 240 },
  visuals = {
    { albedo = { 0.86, 0.80, 0.70 }, roughness = 0.8 },
    { albedo = { 0.93, 0.92, 0.88 }, roughness = 0.4 },
    { albedo = { 0.62, 0.44, 0.26 }, roughness = 0.7 },
  },
}
