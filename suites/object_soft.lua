-- Object-Soft: ten soft objects to put into the basket, each among the distractors of the same task of Object-Rigid.
local layouts = require "layouts.floor"
local pick_place = require "experts.pick_place"
local shifts = require "shifts"

local objects = {
  { "steamed_bun", "pale cream round steamed-bun pastry" },
  { "croissant", "soft pastry" },
  { "yellow_roll", "soft pastry" },
  { "oval_loaf", "soft pastry" },
  { "sesame_bun", "orange round bun pastry with sesame speckles" },
  { "long_roll", "soft pastry" },
  { "cube", "soft cube" },
  { "cylinder", "soft cylinder" },
  { "wedge", "soft wedge" },
  { "capsule", "soft capsule" },
}

local tasks = {}
for k, object in ipairs(objects) do
  local asset, description = object[1], object[2]
  tasks[k] = softvt.task {
    prompt = ("pick up the %s and place it in the basket"):format(description),
    layout = layouts.soft(asset, k),
    goal = softvt.inside { object = asset, target = "basket", hold_s = 0.4 },
    expert = pick_place { object = asset, target = "basket" },
  }
end

return softvt.suite {
  name = "object_soft",
  object_type = "deformable",
  tasks_differ_in = "object",
  needs = "nothing",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.soft,
}
