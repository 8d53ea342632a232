-- The whole benchmark: the four suites of the paper, soft and rigid, with varying objects or layouts, and the two
-- suites in which the grip has to be found by trial.
return {
  require "suites.object_soft",
  require "suites.spatial_soft",
  require "suites.object_rigid",
  require "suites.spatial_rigid",
  require "suites.object_hidden",
  require "suites.spatial_hidden",
}
