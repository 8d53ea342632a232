-- A contact sheet: a close view of every asset on the table, in one image.
--
--   softvt scripts/contact_sheet.lua
--   softvt scripts/contact_sheet.lua --asset my_pastry --write my_pastry.png
local names = require "asset_names"
local views = require "asset_views"

-- Soft objects, rigid objects, articulations. The table and the floor are not listed.
local STANDARD = {}
for _, group in ipairs { names.soft, names.rigid, names.articulated } do
  table.move(group, 1, #group, #STANDARD + 1, STANDARD)
end

local opt = softvt.options {
  asset = { default = STANDARD, help = "assets to draw" },
  write = { default = "docs/images/assets.png", help = "image file to write" },
  columns = { default = 6, integer = true, min = 1, max = 12, help = "images per row" },
  edge = { default = 160, unit = "pixels", integer = true, min = 64, max = 1024, help = "edge of each image" },
}

-- Episodes use only files that were read when the plan was made, so every asset is required here.
local assets = {}
for _, name in ipairs(opt.asset) do
  assets[name] = require("assets." .. name)
end

local WORDS, GROUND = { 40, 44, 50 }, { 244, 243, 240 }
local LABEL, SIZE = 22, 12 -- pixels below each image, and of its letters

local function size_of(name) return views.size(assets[name]) end

return softvt.experiment {
  name = "contact_sheet",
  columns = { "asset", "x_mm", "y_mm", "z_mm" },
  grid = { asset = opt.asset },
  run = function(point)
    local name = point.asset
    local size = size_of(name)
    return { asset = name, x_mm = 1e3 * size[1], y_mm = 1e3 * size[2], z_mm = 1e3 * size[3] }
  end,
  finish = function()
    local columns = math.min(opt.columns, #opt.asset)
    local rows = (#opt.asset + columns - 1) // columns
    local cell = opt.edge + LABEL
    local sheet = softvt.image { width = columns * opt.edge, height = rows * cell, colour = GROUND }
    for index, name in ipairs(opt.asset) do
      local x, y = (index - 1) % columns * opt.edge, (index - 1) // columns * cell
      sheet:paste(views.portrait(assets[name], opt.edge), x, y)
      local words = ("%s, %.0f mm"):format(name:gsub("_", " "), 1e3 * math.max(table.unpack(size_of(name))))
      sheet:text(words, { at = { x + 6, y + opt.edge + 15 }, size = SIZE, colour = WORDS })
    end
    return { files = { [opt.write] = sheet } }
  end,
}
