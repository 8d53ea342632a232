-- Spatial-Hidden: two objects of one kind, one of which is to be put on the plate, as in Spatial-Soft. How stiff,
-- brittle, heavy and slippery each is does not show, and differs between the two and from episode to episode.
local hidden = require "hidden"
local layouts = require "layouts.spatial_soft"

local objects = {
  { asset = "spiral_roll", description = "white spiral pastry with ridged frosting", sides = { "right", "left" } },
  {
    asset = "steamed_bun",
    description = "pale cream round steamed-bun pastry with black eyes",
    sides = { "right", "left" },
  },
  { asset = "small_ridged_roll", description = "small dark brown oval pastry", sides = { "left", "right" } },
  { asset = "golden_bun", description = "golden round bun pastry", sides = { "left", "right" } },
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
      expert = hidden.pick_place(side, "plate"),
    }
  end
end

return hidden.suite { name = "spatial_hidden", tasks_differ_in = "spatial", tasks = tasks }
