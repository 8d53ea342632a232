-- Tactile images in one picture: soft assets in the expert's grasp, and one asset at several forces. A row has the
-- image of the left finger, its difference from the untouched gel, its markers and their motion.
--
--   softvt scripts/imprints.lua
--   softvt scripts/imprints.lua --asset my_pastry --pressed my_pastry --write my_imprint.png
local views = require "asset_views"

local opt = softvt.options {
  asset = {
    default = { "curved_layered", "small_ridged_roll", "oval_loaf", "golden_bun" },
    help = "soft assets to grasp and lift",
  },
  lift_mm = { default = 60, unit = "mm", min = 0, max = 200, help = "height of the lift" },
  pressed = { default = "oval_loaf", help = "soft asset to press at several forces" },
  force = { default = { 0.3, 2, 20 }, unit = "N", min = 0.05, max = 60, help = "forces per pad" },
  write = { default = "docs/images/imprints.png", help = "image file to write" },
}

-- Episodes use only files that were read when the plan was made, so every asset is required here.
local assets = { [opt.pressed] = require("assets." .. opt.pressed) }
for _, name in ipairs(opt.asset) do
  assets[name] = require("assets." .. name)
end

-- A row of the picture: an asset that is lifted, or pressed at a force.
local rows = {}
for _, name in ipairs(opt.asset) do
  rows[#rows + 1] = { asset = name }
end
for _, force in ipairs(opt.force) do
  rows[#rows + 1] = { asset = opt.pressed, force = force }
end
local numbers = {}
for number in ipairs(rows) do
  numbers[number] = number
end

local function reading_of(row)
  local sim
  if row.force then
    sim = views.pressed(assets[row.asset], row.force)
  else
    sim = views.held(assets[row.asset], opt.lift_mm * 1e-3)
  end
  return sim:tactile "left"
end

local WORDS, GROUND = { 40, 44, 50 }, { 244, 243, 240 }
local HEAD, GAP, WORDS_WIDTH = 34, 6, 176 -- pixels
local WIDTH, HEIGHT = 240, 180
local GAIN = 4
local COLUMNS = {
  "image",
  ("difference from rest × %d"):format(GAIN),
  "markers",
  "motion of the markers × 3",
}

-- The difference of two images times GAIN, around grey.
local function difference(image, rest)
  local seen = softvt.image { width = WIDTH, height = HEIGHT, colour = GROUND }
  local small, untouched = image:resize(WIDTH, HEIGHT), rest:resize(WIDTH, HEIGHT)
  for y = 0, HEIGHT - 1 do
    for x = 0, WIDTH - 1 do
      local now, before, colour = small:pixel(x, y), untouched:pixel(x, y), {}
      for channel = 1, 3 do
        colour[channel] = math.max(0, math.min(255, 128 + GAIN * (now[channel] - before[channel])))
      end
      seen:paste(softvt.image { width = 1, height = 1, colour = colour }, x, y)
    end
  end
  return seen
end

-- Mean motion of the markers, px.
local function drift(reading)
  local x, y = 0, 0
  for i, from in ipairs(reading.initial) do
    x, y = x + reading.present[i][1] - from[1], y + reading.present[i][2] - from[2]
  end
  return x / #reading.initial, y / #reading.initial
end

return softvt.experiment {
  name = "imprints",
  columns = { "asset", "asked_n", "force_n", "shear_n", "depth_mm", "markers_x_px", "markers_y_px" },
  grid = { row = numbers },
  run = function(point)
    local row = rows[point.row]
    local reading = reading_of(row)
    local x, y = drift(reading)
    return {
      asset = row.asset,
      asked_n = row.force,
      force_n = -reading.force[3],
      shear_n = math.sqrt(reading.force[1] ^ 2 + reading.force[2] ^ 2),
      depth_mm = reading.depth_mm,
      markers_x_px = x,
      markers_y_px = y,
    }
  end,
  finish = function()
    local picture = softvt.image {
      width = WORDS_WIDTH + #COLUMNS * (WIDTH + GAP) - GAP,
      height = HEAD + #rows * (HEIGHT + GAP),
      colour = GROUND,
    }
    for column, words in ipairs(COLUMNS) do
      local x = WORDS_WIDTH + (column - 1) * (WIDTH + GAP)
      picture:text(words, { at = { x + 4, 22 }, size = 16, colour = WORDS })
    end
    local rest = views.untouched(assets[rows[1].asset]):tactile("left").image
    for number, row in ipairs(rows) do
      local y, reading = HEAD + (number - 1) * (HEIGHT + GAP), reading_of(row)
      local force = -reading.force[3]
      local name = row.asset:gsub("_", " ")
      local words = { name, row.force and "pressed" or "held by the expert", ("%.2g N"):format(force) }
      for line, word in ipairs(words) do
        picture:text(word, { at = { 12, y + 66 + 24 * line }, size = 17, colour = WORDS })
      end
      local images = {
        reading.image:resize(WIDTH, HEIGHT),
        difference(reading.image, rest),
        reading.dots:resize(WIDTH, HEIGHT),
        reading.arrows:resize(WIDTH, HEIGHT),
      }
      for column, image in ipairs(images) do
        picture:paste(image, WORDS_WIDTH + (column - 1) * (WIDTH + GAP), y)
      end
    end
    return { files = { [opt.write] = picture } }
  end,
}
