-- A flat electric stove, 190 × 190 × 70 mm with its knob: an enamelled body on four feet with one cast burner plate,
-- 150 mm across, and a knob on its front (−y) that turns by 270°.
local material = require "materials"
local mask = softvt.mask

local mm = 1e-3
local SIDE, DEPTH, FEET, BODY, HEIGHT = 190 * mm, 166 * mm, 6 * mm, 58 * mm, 70 * mm
local FRONT = -71 * mm -- face of the body; with the knob the middle is y = 0
local PLATE = 75 * mm -- radius of the burner plate
local middle = FRONT + DEPTH / 2

local box, cylinder = softvt.shape.box, softvt.shape.cylinder

local body = box { size = { SIDE, DEPTH, BODY - FEET } }:translate(0, middle, (BODY + FEET) / 2)
for _, x in ipairs { -78 * mm, 78 * mm } do
  for _, y in ipairs { -66 * mm, 66 * mm } do
    body = body:union(
      cylinder { radius = 9 * mm, height = FEET + 2 * mm }
        :translate(x, middle + y, (FEET + 2 * mm) / 2)
        :paint { material = 2 }
    )
  end
end
-- A steel collar under the plate.
local collar = cylinder { radius = PLATE + 5 * mm, height = 4 * mm }:translate(0, middle, BODY + 2 * mm)
local plate =
  cylinder { radius = PLATE, height = HEIGHT - BODY - 4 * mm }:translate(0, middle, (HEIGHT + BODY + 4 * mm) / 2)
body = body:union(collar:paint { material = 3 }):union(plate:paint { material = 1 })

-- The plate is turned on a lathe: fine grooves, and the red dot of a plate that heats quickly.
local function ring(radius, width)
  return mask.inside {
    shape = softvt.shape.torus { major = radius, minor = width }:translate(0, middle, HEIGHT),
    soft_m = 0.8 * mm,
  }
end
local iron = {
  albedo = { 0.040, 0.040, 0.043 },
  roughness = 0.55,
  metalness = 0.35,
  layers = {
    {
      mask = mask.noise { size_m = 5 * mm, octaves = 3, from = 0.4, to = 0.8, seed = 3 },
      albedo = { 0.075, 0.072, 0.07 },
      roughness = 0.65,
      opacity = 0.5,
    },
  },
}
for radius = 18, 66, 8 do
  table.insert(
    iron.layers,
    { mask = ring(radius * mm, 1.2 * mm), albedo = { 0.15, 0.148, 0.145 }, roughness = 0.4, opacity = 0.9 }
  )
end
table.insert(iron.layers, {
  mask = mask.inside {
    shape = cylinder { radius = 10 * mm, height = 0.1 }:translate(0, middle, HEIGHT),
    soft_m = 0.8 * mm,
  },
  albedo = { 0.42, 0.035, 0.022 },
  roughness = 0.45,
  opacity = 0.95,
})

-- The knob: a disc with a grip across it; at 0 the grip is upright.
local KNOB, GRIP, AXIS = 8 * mm, 24 * mm, 32 * mm
local disc = cylinder { radius = 20 * mm, height = KNOB }
  :rotate { axis = "x", angle = math.pi / 2 }
  :translate(0, FRONT - 1 * mm - KNOB / 2, AXIS)
local grip =
  box { size = { 8 * mm, GRIP - KNOB - 1 * mm, 38 * mm } }:translate(0, FRONT - (GRIP + KNOB + 1 * mm) / 2, AXIS)
local pointer = box { size = { 3 * mm, 0.03, 15 * mm } }:translate(0, FRONT - GRIP, AXIS + 13 * mm)

return softvt.asset {
  name = "flat_stove",
  shape = body,
  body = softvt.articulated {
    parts = {
      {
        name = "knob",
        shape = disc:union(grip):paint { material = 1, region = pointer },
        density = 1200,
        joint = softvt.hinge {
          axis = { 0, -1, 0 },
          origin = { 0, FRONT, AXIS },
          lower = 0,
          upper = 1.5 * math.pi,
          damping = 2e-3,
          friction = 8e-3,
        },
        hints = { grip_width_m = 8 * mm, grip_length_m = 38 * mm, grip_depth_m = GRIP - KNOB - 1 * mm },
        visuals = {
          { albedo = { 0.055, 0.057, 0.06 }, roughness = 0.42 },
          { albedo = { 0.82, 0.80, 0.74 }, roughness = 0.5 },
        },
      },
    },
  },
  hints = { surface_m = HEIGHT, plate_radius_m = PLATE, plate_y_m = middle },
  visuals = {
    { -- enamel, a little worn
      albedo = { 0.66, 0.655, 0.63 },
      roughness = 0.28,
      layers = {
        {
          mask = mask.noise { size_m = 35 * mm, octaves = 4, from = 0.45, to = 0.85, seed = 8 },
          albedo = { 0.58, 0.565, 0.53 },
          roughness = 0.34,
          opacity = 0.4,
        },
      },
    },
    iron,
    { albedo = { 0.03, 0.03, 0.032 }, roughness = 0.8 },
    material.steel { along = "x", seed = 12 },
  },
}
