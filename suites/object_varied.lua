-- Object-Varied: the tasks of Object-Soft, in which no two objects of a kind are alike. Size, stiffness, density,
-- friction, colour, light and camera differ from episode to episode. The safe closure follows from the size, which can
-- be seen or felt.
local object_soft = require "suites.object_soft"
local standard = require "variations.standard"

return softvt.suite {
  name = "object_varied",
  object_type = "deformable",
  tasks_differ_in = "object",
  needs = "size",
  episodes = 5,
  tasks = object_soft.tasks,
  shifts = object_soft.shifts,
  vary = standard,
}
