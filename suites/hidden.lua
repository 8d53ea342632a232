-- The two suites in which the grip has to be found by trial.
--
--   softvt suites/hidden.lua --policy tactile-servo
return { require "suites.object_hidden", require "suites.spatial_hidden" }
