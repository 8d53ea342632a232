-- Object-Twin: the rigid twin of Object-Soft. Shapes, looks, masses, layouts, initial states and prompts are the same; nothing deforms.
-- softvt compare pairs its runs with those of Object-Soft by task and episode.
local shifts = require "shifts"
local soft = require "suites.object_soft"

return softvt.suite {
  name = "object_twin",
  object_type = "rigid",
  twin_of = soft.name,
  tasks_differ_in = soft.tasks_differ_in,
  needs = "nothing",
  episodes = soft.episodes,
  tasks = soft.tasks,
  shifts = shifts.rigid,
}
