-- A wooden cabinet, 255 × 221 × 218 mm with its handles, with three drawers that slide out of its front (−y) by 150 mm.
--
-- Inside, each drawer is 225 × 174 mm and 40 mm deep under its rim. Open by q it shows q of its length in front of the
-- cabinet: at 0.12 m a bowl of 107 mm fits into the top drawer with 13 mm to spare along the drawer and 118 mm across
-- it. Panels are 8 mm, walls of drawers 5 mm thick; all of it is boxes, so that contact with it is exact.
local material = require "materials"

local mm = 1e-3
local WIDTH, DEPTH, HEIGHT = 255, 191, 218 -- of the body; fronts and handles stand out by 30 mm
local FRONT, BACK = -80.5, 110.5 -- faces of the body; with the handles its middle is y = 0
local PANEL, WALL, OVERLAY, PLAY = 8, 5, 10, 2
local TOP, REVEAL = 12, 2 -- thickness of the top board, gap around fronts
local bay = (HEIGHT - TOP - 4 * PANEL) / 3 + PANEL -- from one drawer to the next

-- A box between two corners, mm.
local function block(x1, x2, y1, y2, z1, z2)
  local size = { (x2 - x1) * mm, (y2 - y1) * mm, (z2 - z1) * mm }
  return softvt.shape.box { size = size }:translate((x1 + x2) / 2 * mm, (y1 + y2) / 2 * mm, (z1 + z2) / 2 * mm)
end

local half = WIDTH / 2
local board = block(-half, half, FRONT, BACK, HEIGHT - TOP, HEIGHT)
local body = board
  :union(block(-half, -half + PANEL, FRONT, BACK, 0, HEIGHT - TOP))
  :union(block(half - PANEL, half, FRONT, BACK, 0, HEIGHT - TOP))
  :union(block(-half + PANEL, half - PANEL, BACK - PANEL, BACK, 0, HEIGHT - TOP))
for level = 0, 3 do
  local z = level * bay
  if level < 3 then body = body:union(block(-half + PANEL, half - PANEL, FRONT, BACK - PANEL, z, z + PANEL)) end
end

-- The closed drawer of a level (0 is the lowest), the height of its handle, and how far its floor lies above its lowest
-- point, mm.
local function drawer(level)
  local z = level * bay + PANEL + PLAY
  local side, back, rim = half - PANEL - PLAY - 0.25, BACK - PANEL - PLAY, z + WALL + 40
  local low, high = level * bay + PANEL / 2 + REVEAL / 2, (level + 1) * bay + PANEL / 2 - REVEAL / 2
  local front = block(-half + REVEAL, half - REVEAL, FRONT - OVERLAY, FRONT, low, high)
  local box = block(-side, side, FRONT, back, z, z + WALL)
    :union(block(-side, -side + WALL, FRONT, back, z + WALL, rim))
    :union(block(side - WALL, side, FRONT, back, z + WALL, rim))
    :union(block(-side + WALL, side - WALL, back - WALL, back, z + WALL, rim))
  -- A bar of 9 mm on two posts, 11 mm in front of the drawer.
  local middle, out = (low + high) / 2, FRONT - OVERLAY
  local bar = softvt.shape
    .cylinder { radius = 4.5 * mm, height = 96 * mm }
    :rotate { axis = "y", angle = math.pi / 2 }
    :translate(0, (out - 15.5) * mm, middle * mm)
  local posts = block(-36, -29, out - 15.5, out, middle - 3.5, middle + 3.5):union(
    block(29, 36, out - 15.5, out, middle - 3.5, middle + 3.5)
  )
  local shape = front:union(box:paint { material = 1 }):union(bar:union(posts):paint { material = 2 })
  return shape, middle, z + WALL - low
end

local birch = material.wood {
  base = { 0.62, 0.49, 0.32 },
  light = { 0.68, 0.555, 0.385 },
  dark = { 0.46, 0.33, 0.19 },
  length_m = 0.6,
  width_m = 0.09,
  seed = 17,
}
local brass = material.steel { base = { 0.55, 0.42, 0.22 }, roughness = 0.34, seed = 5 }
local function front_wood(level)
  return material.wood {
    base = { 0.40, 0.215, 0.095 },
    light = { 0.47, 0.265, 0.125 },
    dark = { 0.20, 0.095, 0.04 },
    length_m = 0.9,
    width_m = 0.3,
    seed = 40 + level,
  }
end

local parts = {}
for level, name in ipairs { "bottom_drawer", "middle_drawer", "top_drawer" } do
  local shape, handle, bottom = drawer(level - 1)
  parts[level] = {
    name = name,
    shape = shape,
    density = 550,
    joint = softvt.slider { axis = { 0, -1, 0 }, lower = 0, upper = 0.15, damping = 6, friction = 1.2 },
    hints = {
      handle_height_m = handle * mm,
      handle_out_m = (15.5 - FRONT + OVERLAY) * mm,
      handle_width_m = 9 * mm,
      surface_m = bottom * mm,
    },
    visuals = { front_wood(level), birch, brass },
  }
end

return softvt.asset {
  name = "wooden_cabinet",
  shape = body:paint { material = 1, region = board },
  body = softvt.articulated { parts = parts },
  hints = { surface_m = HEIGHT * mm },
  visuals = {
    material.wood {
      base = { 0.30, 0.155, 0.07 },
      light = { 0.36, 0.195, 0.09 },
      dark = { 0.15, 0.07, 0.03 },
      length_m = 0.7,
      width_m = 0.24,
      seed = 61,
    },
    material.wood {
      base = { 0.36, 0.19, 0.085 },
      light = { 0.43, 0.24, 0.11 },
      dark = { 0.19, 0.09, 0.04 },
      length_m = 0.8,
      width_m = 0.11,
      seed = 62,
    },
  },
}
