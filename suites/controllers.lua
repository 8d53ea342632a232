-- Controllers that differ in their grip alone, on the varied suites: the same expert knows the object (reference), closes by touch,
-- closes to one closure per kind of object, or fully. Prints one table per suite.
--
--   softvt suites/controllers.lua --episodes 50
return softvt.conditions {
  name = "controllers",
  suites = { require "suites.object_varied", require "suites.spatial_varied" },
  conditions = {
    { name = "tactile-servo", policy = "tactile-servo" },
    { name = "fixed-closure", policy = "fixed-closure" },
    { name = "expert-binary", policy = "expert-binary" },
  },
}
