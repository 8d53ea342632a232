-- Spatial-Soft: two identical pastries, one plate; the prompt says which one to put on it.
local pick_place = require "experts.pick_place"
local layouts = require "layouts.spatial_soft"
local shifts = require "shifts"

local pairs_of = {
  { asset = "spiral_roll", says = "white spiral pastry with ridged frosting", sides = { "right", "left" } },
  { asset = "steamed_bun", says = "pale cream round steamed-bun pastry with black eyes", sides = { "right", "left" } },
  { asset = "small_ridged_roll", says = "small dark brown oval pastry", sides = { "left", "right" } },
  { asset = "braided_roll", says = "long golden braided pastry with orange stripes", sides = { "left", "right" } },
  { asset = "sesame_bun", says = "orange round bun pastry with sesame speckles", sides = { "right", "left" } },
}

local tasks = {}
for k, pair in ipairs(pairs_of) do
  local layout = layouts.pair(pair.asset, k)
  for _, side in ipairs(pair.sides) do
    tasks[#tasks + 1] = softvt.task {
      prompt = ("pick up the %s %s and place it on the plate"):format(side, pair.says),
      layout = layout,
      goal = softvt.on { object = side, target = "plate", hold_s = 0.4 },
      expert = pick_place { object = side, target = "plate" },
    }
  end
end

return softvt.suite {
  name = "spatial_soft",
  object_type = "deformable",
  variation = "spatial",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.soft,
}
