-- The hidden variation: besides size and looks, every object differs in properties that do not show. Its safe grip
-- forces lie within a factor of 1.25 to 1.5, and where they lie has to be found by trial.
--
--   softvt suites/object_soft.lua --vary=scripts/variations/hidden.lua
local standard = require "variations.standard"

return softvt.variation {
  name = "hidden",
  size = standard.size,
  stiffness = { 1, 1 },
  density = { 1, 1 },
  friction = { 1, 1 },
  hidden = {
    aeration = { 0.5, 2.5 },
    staling = { 1, 6 },
    filling = { 1, 4 },
    coating = { 0.2, 1.5 },
    window_ratio = { 1.25, 1.5 },
  },
  colour = standard.colour,
  light = standard.light,
  camera_offset = standard.camera_offset,
  camera_rotation = standard.camera_rotation,
}
