-- Spatial-Twin: the rigid twin of Spatial-Soft. Shapes, looks, masses, layouts, initial states and prompts are the same; nothing deforms.
-- softvt compare pairs its runs with those of Spatial-Soft by task and episode.
local shifts = require "shifts"
local soft = require "suites.spatial_soft"

return softvt.suite {
  name = "spatial_twin",
  object_type = "rigid",
  twin_of = soft.name,
  tasks_differ_in = soft.tasks_differ_in,
  needs = "nothing",
  episodes = soft.episodes,
  tasks = soft.tasks,
  shifts = shifts.rigid,
}
