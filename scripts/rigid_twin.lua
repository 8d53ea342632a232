-- The rigid twin of a suite: shapes, looks, masses, layouts, initial states and prompts are the same, and nothing
-- deforms.
local shifts = require "shifts"

return function(name, soft)
  return softvt.suite {
    name = name,
    object_type = "rigid",
    twin_of = soft.name,
    tasks_differ_in = soft.tasks_differ_in,
    needs = "nothing",
    episodes = soft.episodes,
    tasks = soft.tasks,
    shifts = shifts.rigid,
  }
end
