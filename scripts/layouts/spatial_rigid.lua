-- The table scene of Spatial-Rigid: two black bowls, a plate, a ramekin, a box of cookies, a cabinet and a stove; the bowl that
-- is meant stands in one of ten relations to them. Places are those of LIBERO's spatial suite.
local arrange = require "layouts.arrange"
local scenery = require "scenery"

local mm = 1e-3
-- LIBERO's regions reach this far about their middle, either way.
local REGION = 10 * mm
-- What stands on something else is off its middle by at most this.
local ON_TOP = 4 * mm

local bowl, plate, ramekin = require "assets.black_bowl", require "assets.plate", require "assets.ramekin"
local cookies, cabinet, stove = require "assets.cookies", require "assets.wooden_cabinet", require "assets.flat_stove"
local table_top = require "assets.table"

-- Middles of the regions, m.
local PLACES = {
  plate = { 60 * mm, 200 * mm }, next_to_plate = { 10 * mm, 330 * mm }, cookies = { 70 * mm, 30 * mm },
  next_to_cookies = { 130 * mm, -70 * mm }, between_plate_and_ramekin = { -60 * mm, 205 * mm },
  ramekin = { -200 * mm, 200 * mm }, next_to_ramekin = { -180 * mm, 325 * mm }, table_center = { -75 * mm, 0 },
  cabinet = { 30 * mm, -270 * mm }, stove = { -410 * mm, -140 * mm },
}
local CABINET_YAW, CABINET_TURN = 2.69, 0.03
-- How far the top drawer is open where a bowl is in it, m.
local OPEN = 0.15

-- Where the two bowls are, by relation: the one that is meant, the other.
local RELATIONS = {
  { "between_plate_and_ramekin", "next_to_ramekin" },
  { "next_to_ramekin", "next_to_cookies" },
  { "table_center", "next_to_plate" },
  { "on_cookies", "on_cabinet" },
  { "in_drawer", "on_cabinet" },
  { "on_ramekin", "on_cookies" },
  { "next_to_cookies", "on_stove" },
  { "on_stove", "on_cabinet" },
  { "next_to_plate", "next_to_ramekin" },
  { "on_cabinet", "on_stove" },
}

return RELATIONS
