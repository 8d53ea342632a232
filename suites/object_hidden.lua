-- Object-Hidden: soft objects to put into the basket, as in Object-Soft. How stiff, brittle, heavy and slippery each is does not show and
-- differs from episode to episode, and the safe grip forces of each lie within a factor of about two.
local layouts = require "layouts.floor"
local pick_place = require "experts.pick_place"
local shifts = require "shifts"

-- Kinds that are often within the window: the croissant and the oval loaf are too strong for their weight, the long kinds bend.
local objects = {
  { "steamed_bun", "pale cream round steamed-bun pastry" },
  { "spiral_roll", "white spiral pastry with ridged frosting" },
  { "yellow_roll", "soft pastry" },
  { "golden_bun", "golden round bun pastry" },
  { "sesame_bun", "orange round bun pastry with sesame speckles" },
  { "small_ridged_roll", "small ridged pastry" },
  { "cube", "soft cube" },
  { "cylinder", "soft cylinder" },
  { "sphere", "soft ball" },
  { "capsule", "soft capsule" },
}

local tasks = {}
for k, object in ipairs(objects) do
  local asset, description = object[1], object[2]
  tasks[k] = softvt.task {
    prompt = ("pick up the %s and place it in the basket"):format(description),
    layout = layouts.soft(asset, k),
    goal = softvt.inside { object = asset, target = "basket", hold_s = 0.4 },
    expert = pick_place { object = asset, target = "basket", stop = "touch", window = 0.3 },
  }
end

return softvt.suite {
  name = "object_hidden",
  object_type = "deformable",
  variation = "object",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.soft,
  teacher = "tactile-servo",
  vary = require "variations.hidden",
}
