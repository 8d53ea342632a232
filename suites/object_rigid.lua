-- Object-Rigid: the prompt names one of ten groceries to put into the basket (LIBERO's object suite).
local layouts = require "layouts.floor"
local pick_place = require "experts.pick_place"
local shifts = require "shifts"

local tasks = {}
for k = 1, 10 do
  local target = layouts.target(k)
  tasks[k] = softvt.task {
    prompt = ("pick up the %s and place it in the basket"):format(target:gsub("_", " ")),
    layout = layouts.rigid(k),
    goal = softvt.inside { object = target, target = "basket", hold_s = 0.4 },
    expert = pick_place { object = target, target = "basket" },
  }
end

return softvt.suite {
  name = "object_rigid",
  object_type = "rigid",
  tasks_differ_in = "object",
  needs = "nothing",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.rigid,
}
