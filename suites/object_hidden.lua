-- Object-Hidden: soft objects to put into the basket, as in Object-Soft. How stiff, brittle, heavy and slippery each is does not show and
-- differs from episode to episode, and the safe grip forces of each lie within a factor of 1.25 to 1.5.
local layouts = require "layouts.floor"
local pick_place = require "experts.pick_place"
local shifts = require "shifts"

-- Kinds whose limit and window are known well at any size and stiffness. The long kinds bend by their own weight, D of the wedge grows
-- as it is lifted, and τ of the oval loaf jumps where another of its ridges meets a pad.
local objects = {
  { "steamed_bun", "pale cream round steamed-bun pastry" },
  { "spiral_roll", "white spiral pastry with ridged frosting" },
  { "yellow_roll", "yellow roll pastry" },
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
    expert = pick_place { object = asset, target = "basket", stop = "touch", window = 0.1, closing_speed = 0.003 },
  }
end

return softvt.suite {
  name = "object_hidden",
  object_type = "deformable",
  tasks_differ_in = "object",
  needs = "touch",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.soft,
  teacher = "tactile-servo",
  vary = require "variations.hidden",
  settings = {
    -- Noise of a real GelSight Mini (docs/tactile.md).
    tactile = { wear = { noise_px = 0.1, image_noise = 0.7 } },
    -- An object must not slip in the hand by more than 2 mm while it is carried.
    criteria = { require_no_slip = true },
  },
}
