-- Object-Twin: the rigid twin of Object-Soft. Shapes, looks, masses, layouts, initial states and prompts are the same;
-- nothing deforms. softvt compare pairs its runs with those of Object-Soft by task and episode.
local rigid_twin = require "rigid_twin"

return rigid_twin("object_twin", require "suites.object_soft")
