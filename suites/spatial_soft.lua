-- Spatial-Soft: two identical pastries; the prompt says which one to put on the plate.
local pick_place = require "experts.pick_place"
local layouts = require "layouts.spatial_soft"
local shifts = require "shifts"

local objects = {
  { asset = "spiral_roll", description = "white spiral pastry with ridged frosting", sides = { "right", "left" } },
  {
    asset = "steamed_bun",
    description = "pale cream round steamed-bun pastry with black eyes",
    sides = { "right", "left" },
  },
  { asset = "small_ridged_roll", description = "small dark brown oval pastry", sides = { "left", "right" } },
  {
    asset = "braided_roll",
    description = "long golden braided pastry with orange stripes",
    sides = { "left", "right" },
  },
  { asset = "sesame_bun", description = "orange round bun pastry with sesame speckles", sides = { "right", "left" } },
}

local tasks = {}
for k, object in ipairs(objects) do
  local layout = layouts.pair(object.asset, k)
  for _, side in ipairs(object.sides) do
    tasks[#tasks + 1] = softvt.task {
      prompt = ("pick up the %s %s and place it on the plate"):format(side, object.description),
      layout = layout,
      goal = softvt.on { object = side, target = "plate", hold_s = 0.4 },
      expert = pick_place { object = side, target = "plate" },
    }
  end
end

return softvt.suite {
  name = "spatial_soft",
  object_type = "deformable",
  tasks_differ_in = "spatial",
  needs = "nothing",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.soft,
}
