-- How many verdicts of a suite turn with the time step and with the mesh of the soft bodies: the same episodes at 120
-- and 240 Hz, and with the actions of the reference on a mesh 1.5 times as fine. Limits stay.
--
--   softvt scripts/verdict_checks.lua --suite object_hidden --policy tactile-servo --episodes 20
local suites_of = require "suites_of"

local opt = softvt.options {
  suite = { default = { "object_hidden", "spatial_hidden" }, help = "suites to check: files of suites/, without .lua" },
}

return softvt.conditions {
  name = "verdict_checks",
  suites = suites_of(opt.suite),
  conditions = {
    { name = "120 Hz", set = { ["physics.dt"] = 1 / 120 } },
    { name = "240 Hz", set = { ["physics.dt"] = 1 / 240 } },
    { name = "mesh x1.5", set = { ["physics.mesh_refinement"] = 1.5 }, replay = true },
  },
}
