-- A soft toy capsule, 44 mm thick and 78 mm long, lying: silicone in two colours, like a pill. It is drawn 3 % higher
-- and cut off below by as much: on a foot 16 mm wide it does not roll.
local material = require "materials"

local mm = 1e-3
local RADIUS, LENGTH, BELOW = 22 * mm, 78 * mm, 1.5 * mm
local HEIGHT = 2 * RADIUS

local pill = softvt.shape
  .capsule { radius = RADIUS, length = LENGTH }
  :rotate { axis = "y", angle = math.pi / 2 }
  :scale(1, 1, (HEIGHT + BELOW) / HEIGHT)
  :translate(0, 0, (HEIGHT - BELOW) / 2)
local table_top = softvt.shape.box { size = { 0.2, 0.1, 0.02 } }:translate(0, 0, -0.01)
local half = softvt.shape.box { size = { 0.1, 0.1, 0.2 } }:translate(50 * mm, 0, 0)

return softvt.asset {
  name = "capsule",
  shape = pill:subtract(table_top, 2 * mm):paint { material = 1, region = half },
  -- It is 4.5 voxels wide; with the usual six along its length it would be 3.4.
  body = softvt.soft {
    youngs_pa = 30e3,
    poisson = 0.40,
    density = 200,
    loss_factor = 0.10,
    resolution = 8,
    collapse_strain = 0.10,
    damage_strain = 0.60,
  },
  hints = { grasp_height_m = HEIGHT / 2 },
  visuals = {
    material.silicone { base = { 0.80, 0.76, 0.70 }, seed = 161 },
    material.silicone { base = { 0.36, 0.13, 0.50 }, seed = 162 },
  },
}
