-- The two suites that need touch.
--
--   softvt suites/hidden.lua --policy tactile-servo
return { require "suites.object_hidden", require "suites.spatial_hidden" }
