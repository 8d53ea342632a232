-- The asset page, docs/assets.md: of every asset a picture, what a finger feels of it, size, mass, material, τ and closures.
--
--   softvt scripts/asset_page.lua
--   softvt scripts/asset_page.lua --pictures=off          only the page
--   softvt scripts/asset_page.lua --asset my_pastry --folder my_page
local names = require "asset_names"
local studio = require "studio"

local STANDARD = {}
for _, group in ipairs { names.soft, names.rigid, names.furniture } do table.move(group, 1, #group, #STANDARD + 1, STANDARD) end

local opt = softvt.options {
  asset = { default = STANDARD, help = "assets to show" },
  pictures = { default = true, help = "whether to draw the pictures, too" },
  folder = { default = "docs", help = "folder of the page" },
  edge = { default = 128, unit = "pixels", integer = true, min = 32, max = 512, help = "edge of each picture" },
}

local assets, known = {}, {}
for _, name in ipairs(opt.asset) do
  assets[name] = require("assets." .. name)
  known[name] = softvt.calibration(name)
end

local HEAD = [[
# Assets

Written by `softvt scripts/asset_page.lua`; a test compares it with what the binary says. *Seen*: the asset alone on the table.
*Felt*: the left finger's picture of it in the expert's grasp, lifted by 60 mm; none where a hand that opens 80 mm finds no
hold. Sizes are those of the bounding box as it stands. Friction is static / dynamic; pads have 1.5 / 1.2, and a pair takes the
larger. τ is the limit of D, % of the bounding box's diagonal; *holds from* and *τ at* are closures of the gripper, between which
it is safe ([calibration.md](calibration.md)).
]]
local SOFT = [[

## Soft

Linear elastic, isotropic finite elements in a rotating frame: Young's modulus E, Poisson's ratio ν.

| asset | seen | felt | size mm | mass g | E kPa | ν | density kg/m³ | friction | τ % | holds from | τ at |
|---|---|---|---|---|---|---|---|---|---|---|---|
]]
local RIGID = [[

## Rigid

| asset | seen | felt | size mm | mass g | density kg/m³ | friction |
|---|---|---|---|---|---|---|
]]
local JOINTED = [[

## Jointed

A fixed base and parts on joints; masses are those of the parts.

| asset | seen | size mm | friction | parts |
|---|---|---|---|---|
]]

local function kind(asset) return tostring(asset.body) end

-- Whether the expert's hand can hold the asset at all, from above or by its rim.
local function holds(asset)
  local hints, size = asset.hints or {}, studio.size(asset)
  if kind(asset) == "softvt.articulated" then return false end
  return hints.grasp_rim_m ~= nil or (hints.grasp_width_m or math.min(size[1], size[2])) < 0.08
end

local function picture(name, what) return ("![](pictures/assets/%s%s.png)"):format(name, what) end

local function millimetres(asset)
  local size = studio.size(asset)
  return ("%.0f × %.0f × %.0f"):format(1e3 * size[1], 1e3 * size[2], 1e3 * size[3])
end

local function friction(asset) return ("%g / %g"):format(asset.friction.static_mu, asset.friction.dynamic_mu) end

local function grams(shape, density) return ("%.1f"):format(1e3 * density * shape:volume()) end

local function parts(asset)
  local list = {}
  for _, part in ipairs(asset.body.parts) do
    local slides = tostring(part.joint) == "softvt.slider"
    local unit, scale = slides and "mm" or "°", slides and 1e3 or math.deg(1)
    list[#list + 1] = ("%s: %s g, %.0f to %.0f %s"):format(
      part.name, grams(part.shape, part.density), scale * part.joint.lower, scale * part.joint.upper, unit)
  end
  return table.concat(list, "; ")
end

local function row(name)
  local asset, cells = assets[name], { ("<a id=%q></a>%s"):format(name, name), picture(name, "") }
  local function add(...) for _, cell in ipairs { ... } do cells[#cells + 1] = cell end end
  if kind(asset) == "softvt.articulated" then
    add(millimetres(asset), friction(asset), parts(asset))
  else
    local body = asset.body
    add(holds(asset) and picture(name, "_felt") or "–", millimetres(asset), grams(asset.shape, body.density))
    if kind(asset) == "softvt.soft" then add(("%g"):format(body.youngs_pa / 1e3), ("%.2f"):format(body.poisson)) end
    add(("%g"):format(body.density), friction(asset))
    if kind(asset) == "softvt.soft" then
      local limit = known[name]
      local function number(format, value) return value and format:format(value) or "–" end
      add(number("%.3f", limit and limit.tau), number("%.2f", limit and limit.lower), number("%.3f", limit and limit.closure_at_tau))
    end
  end
  return "| " .. table.concat(cells, " | ") .. " |\n"
end

local function page(made)
  local sections = { ["softvt.soft"] = { SOFT }, ["softvt.rigid"] = { RIGID }, ["softvt.articulated"] = { JOINTED } }
  for _, name in ipairs(opt.asset) do
    local rows = sections[kind(assets[name])]
    if rows then rows[#rows + 1] = made[name] end
  end
  local text = HEAD
  for _, key in ipairs { "softvt.soft", "softvt.rigid", "softvt.articulated" } do
    if #sections[key] > 1 then text = text .. table.concat(sections[key]) end
  end
  return text
end

return softvt.experiment {
  name = "asset_page",
  columns = { "asset", "x_mm", "y_mm", "z_mm" },
  grid = { asset = opt.asset },
  run = function(point)
    local size = studio.size(assets[point.asset])
    return {
      asset = point.asset, x_mm = 1e3 * size[1], y_mm = 1e3 * size[2], z_mm = 1e3 * size[3], text = row(point.asset),
    }
  end,
  finish = function(rows)
    local made = {}
    for _, row in ipairs(rows) do made[row.asset] = row.text end
    local files = { [opt.folder .. "/assets.md"] = page(made) }
    for _, name in ipairs(opt.pictures and opt.asset or {}) do
      local at = ("%s/pictures/assets/%s"):format(opt.folder, name)
      files[at .. ".png"] = studio.portrait(assets[name], opt.edge)
      if holds(assets[name]) then
        files[at .. "_felt.png"] = studio.held(assets[name], 0.06):feel("left").picture:resize(opt.edge * 4 // 3, opt.edge)
      end
    end
    return { files = files }
  end,
}
