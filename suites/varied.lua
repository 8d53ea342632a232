-- The two suites in which the size differs and shows.
--
--   softvt suites/varied.lua --policy size-seen
return { require "suites.object_varied", require "suites.spatial_varied" }
