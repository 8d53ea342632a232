-- The whole benchmark: four suites, matched two by two.
return {
  require "suites.object_soft", require "suites.spatial_soft", require "suites.object_rigid", require "suites.spatial_rigid",
}
