-- What the hidden suites have in common: how stiff, brittle, heavy and slippery an object is does not show. No constant
-- number is safe; the grip has to be found by trial. The teacher feels it; sight and the load of the arm find it too.
local pick_place = require "experts.pick_place"
local shifts = require "shifts"

local hidden = {}

-- An expert that closes slowly until the object holds, in the loosest tenth of the safe window.
function hidden.pick_place(object, target)
  return pick_place { object = object, target = target, stop = "touch", window = 0.1, closing_speed = 0.003 }
end

-- The suite with a name, tasks, and what these differ in.
function hidden.suite(spec)
  return softvt.suite {
    name = spec.name,
    object_type = "deformable",
    tasks_differ_in = spec.tasks_differ_in,
    needs = "trial",
    episodes = 5,
    tasks = spec.tasks,
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
end

return hidden
