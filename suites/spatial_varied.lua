-- Spatial-Varied: the tasks of Spatial-Soft with two objects of one kind that differ from each other, and from episode
-- to episode, in size, stiffness, density, friction and colour.
local spatial_soft = require "suites.spatial_soft"
local standard = require "variations.standard"

return softvt.suite {
  name = "spatial_varied",
  object_type = "deformable",
  tasks_differ_in = "spatial",
  needs = "size",
  episodes = 5,
  tasks = spatial_soft.tasks,
  shifts = spatial_soft.shifts,
  vary = standard,
}
