-- The standard variation: no two objects of a kind are alike. The size decides how far a hand has to close; stiffness
-- and density change forces but hardly the safe widths. Colour, light and camera do not depend on them.
--
--   softvt suites/object_soft.lua --vary
return softvt.variation {
  name = "standard",
  size = { 0.88, 1.12 },
  stiffness = { 0.7, 2.1 },
  density = { 0.5, 1.2 },
  -- The pads' friction is the larger one, so that this counts where an object slides on its support.
  friction = { 0.7, 1.4 },
  colour = 0.1,
  light = { 0.7, 1.4 },
  camera_offset = 0.01,
  camera_rotation = math.rad(1),
}
