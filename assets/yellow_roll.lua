-- A yellow rolled pastry, 70 × 50 × 46 mm: a Swiss roll that lies on its side, yellow sponge wound up with cream, the
-- spiral showing at both ends, icing sugar on top.
local material = require "materials"

local mm = 1e-3
local LENGTH, WIDTH, HEIGHT = 70 * mm, 50 * mm, 46 * mm

-- The foot is cut flat, so that the roll does not roll.
local EDGE, BELOW = 4 * mm, 3.5 * mm
local TALL = (HEIGHT + BELOW) / WIDTH
local radius = WIDTH / 2
local function drum(deep)
  return softvt.shape
    .cylinder { radius = radius - EDGE, height = LENGTH - 2 * EDGE }
    :round(EDGE - deep)
    :rotate { axis = "y", angle = math.pi / 2 }
end
local table_top = softvt.shape.box { size = { 0.2, 0.1, 0.02 } }:translate(0, 0, -0.01)

-- The cream has sunk a little at the ends: a narrow spiral groove, and nothing of it on the side that fingers touch.
local SUNK = 1.6 * mm
local roll = drum(0)
for _, side in ipairs { -1, 1 } do
  roll = roll:ridges {
    axis = "x",
    count = 1,
    radial_pitch = 9 * mm,
    height = -SUNK,
    sharpness = 1.6,
    mask = { axis = "x", from = side * 30.5 * mm, to = side * 33.5 * mm },
  }
end
local function lie(shape) return shape:scale(1, 1, TALL):translate(0, 0, (HEIGHT - BELOW) / 2) end
local heart =
  softvt.shape.cylinder { radius = radius - 4 * mm, height = 0.1 }:rotate { axis = "y", angle = math.pi / 2 }
local cream = lie(drum(0.55 * mm):intersect(heart))

local skin = material.crust {
  base = { 0.86, 0.60, 0.115 },
  top = { 0.80, 0.47, 0.075 },
  browning = 0.5,
  foot = { 0.87, 0.66, 0.22 },
  sheen = 0.6,
  seed = 121,
}

return softvt.asset {
  name = "yellow_roll",
  shape = lie(roll):subtract(table_top, 2 * mm):paint { material = 1, region = cream },
  -- It is 5.7 voxels wide; with the usual six along its length it would be 4.3.
  body = softvt.soft {
    youngs_pa = 55e3,
    poisson = 0.34,
    density = 230,
    loss_factor = 0.20,
    resolution = 8,
    collapse_strain = 0.08,
    damage_strain = 0.20,
  },
  hints = { grasp_height_m = 22.5 * mm },
  visuals = {
    material.floured(skin, { seed = 125, opacity = 0.6, size_m = 6 * mm }),
    material.frosting { base = { 0.90, 0.86, 0.74 }, seed = 126 },
  },
}
