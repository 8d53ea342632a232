-- Spatial-Rigid: one of two black bowls is to be put on the plate; the prompt describes its location (LIBERO's spatial
-- suite).
local layouts = require "layouts.spatial_rigid"
local pick_place = require "experts.pick_place"
local shifts = require "shifts"

local locations = {
  "between the plate and the ramekin",
  "next to the ramekin",
  "from table center",
  "on the cookie box",
  "in the top drawer of the wooden cabinet",
  "on the ramekin",
  "next to the cookie box",
  "on the stove",
  "next to the plate",
  "on the wooden cabinet",
}

local tasks = {}
for k, location in ipairs(locations) do
  tasks[k] = softvt.task {
    prompt = ("pick up the black bowl %s and place it on the plate"):format(location),
    layout = layouts.relation(k),
    goal = softvt.on { object = "bowl", target = "plate", hold_s = 0.4 },
    expert = pick_place { object = "bowl", target = "plate" },
  }
end

return softvt.suite {
  name = "spatial_rigid",
  object_type = "rigid",
  tasks_differ_in = "spatial",
  needs = "nothing",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.rigid,
}
