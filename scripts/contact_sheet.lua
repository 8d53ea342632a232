-- A contact sheet: every asset alone on the table, seen from near by, in one picture.
--
--   softvt scripts/contact_sheet.lua
--   softvt scripts/contact_sheet.lua --asset my_pastry --write my_pastry.png
local names = require "asset_names"
local table_top = require "assets.table"

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
local FOVY = math.rad(28)

local function size_of(name)
  local low, high = assets[name].shape:bounds()
  return { high[1] - low[1], high[2] - low[2], high[3] - low[3] }
end

-- The asset alone, with a camera that it fills: its bounding sphere just fits the picture.
local function alone(name)
  local size = size_of(name)
  local across = math.sqrt(size[1] ^ 2 + size[2] ^ 2 + size[3] ^ 2)
  local reach = 0.99 * across / 2 / math.sin(FOVY / 2)
  return softvt.layout("portrait_" .. name, function(scene)
    scene:add { name = "table", asset = table_top, xyz = { 0, 0, 0 } }
    scene:add { name = "object", asset = assets[name], at = { 0.1, 0 }, yaw = math.rad(25) }
    local middle = { 0.1, 0, size[3] / 2 }
    scene:add_camera {
      name = "portrait", position = { 0.1 + reach * 0.71, -reach * 0.335, middle[3] + reach * 0.62 }, look_at = middle,
      fovy = FOVY, width = opt.edge, height = opt.edge,
    }
  end)
end

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
      local sim = softvt.simulate { layout = alone(name) }
      local x, y = (index - 1) % columns * opt.edge, (index - 1) // columns * cell
      sheet:paste(sim:see { camera = "portrait" }, x, y)
      local words = ("%s, %.0f mm"):format(name:gsub("_", " "), 1e3 * math.max(table.unpack(size_of(name))))
      sheet:text(words, { at = { x + 12, y + opt.edge + 23 }, size = 19, colour = WORDS })
    end
    return { files = { [opt.write] = sheet } }
  end,
}
