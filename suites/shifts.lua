-- The nine standard shifts, one factor at a time, compared with the unmodified reference at the same tasks, initial states and
-- seeds. Writes one table per suite, conditions.json, and an ordinary run folder per condition.
--
--   softvt suites/shifts.lua
--   softvt suites/shifts.lua --suite object_soft,spatial_rigid --episodes 1
local shifts = require "shifts"

local opt = softvt.options {
  suite = { default = { "spatial_soft" }, help = "suites to run: files of suites/, without .lua" },
}

local suites = {}
for _, name in ipairs(opt.suite) do
  local found = require("suites." .. name)
  -- A file may return several, as suites/all.lua does.
  for _, suite in ipairs(#found > 0 and found or { found }) do table.insert(suites, suite) end
end

return softvt.conditions { name = "shifts", suites = suites, conditions = shifts.conditions }
