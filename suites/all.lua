-- The whole benchmark: four suites, soft and rigid, with varying objects and layouts.
return {
  require "suites.object_soft", require "suites.spatial_soft", require "suites.object_rigid", require "suites.spatial_rigid",
}
