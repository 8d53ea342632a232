-- Tactile images of each soft asset in the expert's grasp: image, markers and marker motion in one panel, and their
-- numbers.
--
--   softvt scripts/imprints.lua
--   softvt scripts/imprints.lua --asset my_pastry --write my_imprint.png
local soft_assets = require("asset_names").soft
local views = require "asset_views"

local opt = softvt.options {
  asset = { default = soft_assets, help = "soft assets to grasp" },
  lift_mm = { default = 60, unit = "mm", min = 0, max = 200, help = "height of the lift" },
  write = { default = "docs/images/imprints.png", help = "image file to write" },
  columns = { default = 2, integer = true, min = 1, max = 6, help = "assets per row" },
}

local assets = {}
for _, name in ipairs(opt.asset) do
  assets[name] = require("assets." .. name)
end

local WORDS, GROUND = { 40, 44, 50 }, { 244, 243, 240 }
local LABEL, GAP = 28, 6 -- pixels
local WIDTH, HEIGHT = 240, 180

local function held(name) return views.held(assets[name], opt.lift_mm * 1e-3) end

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
  columns = { "asset", "side", "force_n", "shear_n", "depth_mm", "markers_x_px", "markers_y_px" },
  grid = { asset = opt.asset },
  run = function(point)
    local name = point.asset
    local sim, rows = held(name), {}
    for _, side in ipairs { "left", "right" } do
      local reading = sim:tactile(side)
      local x, y = drift(reading)
      rows[#rows + 1] = {
        asset = name,
        side = side,
        force_n = -reading.force[3],
        shear_n = math.sqrt(reading.force[1] ^ 2 + reading.force[2] ^ 2),
        depth_mm = reading.depth_mm,
        markers_x_px = x,
        markers_y_px = y,
      }
    end
    return rows
  end,
  finish = function()
    local columns = math.min(opt.columns, #opt.asset)
    local group, row = 4 * (WIDTH + GAP) + 3 * GAP, HEIGHT + LABEL
    local rows = (#opt.asset + columns - 1) // columns
    local panel = softvt.image { width = columns * group - 4 * GAP, height = rows * row, colour = GROUND }
    for index, name in ipairs(opt.asset) do
      local sim = held(name)
      local x, y = (index - 1) % columns * group, (index - 1) // columns * row
      local left, right = sim:tactile "left", sim:tactile "right"
      for column, image in ipairs { left.image, left.dots, left.arrows, right.arrows } do
        panel:paste(image:resize(WIDTH, HEIGHT), x + (column - 1) * (WIDTH + GAP), y)
      end
      local words = ("%s: left, its markers, their motion; right, its motion. %.2f N"):format(
        name:gsub("_", " "),
        -left.force[3]
      )
      panel:text(words, { at = { x + 8, y + HEIGHT + 19 }, size = 16, colour = WORDS })
    end
    return { files = { [opt.write] = panel } }
  end,
}
