-- Spatial-Twin: the rigid twin of Spatial-Soft. Shapes, looks, masses, layouts, initial states and prompts are the
-- same; nothing deforms. softvt compare pairs its runs with those of Spatial-Soft by task and episode.
local rigid_twin = require "rigid_twin"

return rigid_twin("spatial_twin", require "suites.spatial_soft")
