-- Object-Hidden: soft objects to put into the basket, as in Object-Soft. How stiff, brittle, heavy and slippery each is
-- does not show and differs from episode to episode, and the safe grip forces of each lie within a factor of 1.25 to
-- 1.5.
local hidden = require "hidden"
local layouts = require "layouts.floor"

-- Kinds whose limit and window are known well at any size and stiffness. The long kinds bend by their own weight, D of
-- the wedge grows as it is lifted, and τ of the oval loaf jumps where another of its ridges meets a pad.
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
    expert = hidden.pick_place(asset, "basket"),
  }
end

return hidden.suite { name = "object_hidden", tasks_differ_in = "object", tasks = tasks }
