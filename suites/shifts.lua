-- Suites under conditions of one changed factor each, compared with the reference at the same tasks, initial states and
-- seeds. Writes one table per suite, conditions.json, and an ordinary run folder per condition.
--
--   softvt suites/shifts.lua
--   softvt suites/shifts.lua --suite object_soft,spatial_rigid --episodes 1
--   softvt suites/shifts.lua --conditions standard,perturbations --policy ws://host:8000
local shifts = require "shifts"
local suites_of = require "suites_of"

local LISTS = { standard = shifts.conditions, all_objects = shifts.all_objects, perturbations = shifts.perturbations }

local opt = softvt.options {
  suite = { default = { "spatial_soft" }, help = "suites to run: files of suites/, without .lua" },
  conditions = {
    default = { "standard" },
    choices = { "standard", "all_objects", "perturbations" },
    help = "conditions: the nine of the later release; mass and stiffness of all objects and darker light; perception and control",
  },
}

local conditions = {}
for _, name in ipairs(opt.conditions) do
  for _, condition in ipairs(LISTS[name]) do
    table.insert(conditions, condition)
  end
end

return softvt.conditions { name = "shifts", suites = suites_of(opt.suite), conditions = conditions }
