-- Controllers that differ only in how the hand closes: the expert knows the object (reference), tactile-servo feels it,
-- look-retry and weigh find its grip by trial without touch, and the others know only what can be seen of it, and the
-- statistics of the suite: each keeps one number constant. The best of these says what a suite needs. Prints one table.
--
--   softvt suites/controllers.lua --episodes 50
return softvt.conditions {
  name = "controllers",
  suites = {
    require "suites.object_varied",
    require "suites.spatial_varied",
    require "suites.object_hidden",
    require "suites.spatial_hidden",
  },
  conditions = {
    { name = "tactile-servo", policy = "tactile-servo" },
    { name = "look-retry", policy = "look-retry" },
    { name = "weigh", policy = "weigh" },
    { name = "size-seen", policy = "size-seen" },
    { name = "contact-depth", policy = "contact-depth" },
    { name = "drives", policy = "drives" },
    { name = "one-force", policy = "one-force" },
    { name = "one-force-for-all", policy = "one-force-for-all" },
    { name = "fixed-closure", policy = "fixed-closure" },
    { name = "expert-binary", policy = "expert-binary" },
  },
}
