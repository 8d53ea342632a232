-- A contact sheet: every asset alone on the table, seen from near by, in one picture.
--
--   softvt scripts/contact_sheet.lua
--   softvt scripts/contact_sheet.lua --asset my_pastry --write my_pastry.png
local names = require "asset_names"
local studio = require "studio"

-- Soft things first, then what they meet, then what stands around; the table and the floor are under all of them.
local STANDARD = {}
for _, group in ipairs { names.soft, names.rigid, names.furniture } do
  table.move(group, 1, #group, #STANDARD + 1, STANDARD)
end

local opt = softvt.options {
  asset = { default = STANDARD, help = "assets to draw" },
  write = { default = "docs/pictures/assets.png", help = "the picture to write" },
  columns = { default = 6, integer = true, min = 1, max = 12, help = "pictures side by side" },
  edge = { default = 320, unit = "pixels", integer = true, min = 64, max = 1024, help = "edge of each picture" },
}

-- Files are served from here on by name, so every asset is read when the plan is made.
local assets = {}
for _, name in ipairs(opt.asset) do assets[name] = require("assets." .. name) end

local WORDS, GROUND = { 40, 44, 50 }, { 244, 243, 240 }
local LABEL = 34  -- pixels under each picture

local function size_of(name) return studio.size(assets[name]) end

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
      sheet:paste(studio.portrait(assets[name], opt.edge), x, y)
      local words = ("%s, %.0f mm"):format(name:gsub("_", " "), 1e3 * math.max(table.unpack(size_of(name))))
      sheet:text(words, { at = { x + 12, y + opt.edge + 23 }, size = 19, colour = WORDS })
    end
    return { files = { [opt.write] = sheet } }
  end,
}
