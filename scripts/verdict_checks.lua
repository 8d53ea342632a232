-- How many verdicts of a suite turn with the time step and with the mesh of the soft bodies: the same episodes at 120
-- and 240 Hz, and with the actions of the reference on a mesh 1.5 times as fine. Limits stay.
--
--   softvt scripts/verdict_checks.lua --suite object_hidden --policy tactile-servo --episodes 20
local opt = softvt.options {
  suite = { default = { "object_hidden", "spatial_hidden" }, help = "suites to check: files of suites/, without .lua" },
}

local suites = {}
for _, name in ipairs(opt.suite) do
  local found = require("suites." .. name)
  -- A file may return several, as suites/all.lua does.
  for _, suite in ipairs(#found > 0 and found or { found }) do
    table.insert(suites, suite)
  end
end

return softvt.conditions {
  name = "verdict_checks",
  suites = suites,
  conditions = {
    { name = "120 Hz", set = { ["physics.dt"] = 1 / 120 } },
    { name = "240 Hz", set = { ["physics.dt"] = 1 / 240 } },
    { name = "mesh x1.5", set = { ["physics.mesh_refinement"] = 1.5 }, replay = true },
  },
}
