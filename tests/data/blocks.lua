-- A rigid block in the mirrored layout of the standard suite, written as a user would. assets/block.lua has 0.2 kg.
local pick_place, layouts = require "experts.pick_place", require "layouts.spatial_soft"
return softvt.suite {
  name = "blocks",
  object_type = "rigid",
  tasks_differ_in = "spatial",
  episodes = 2,
  tasks = {
    softvt.task {
      prompt = "put the left block on the plate",
      layout = layouts.pair("block", 2),
      goal = softvt.on { object = "left", target = "plate", hold_s = 0.4 },
      expert = pick_place { object = "left", target = "plate" },
    },
  },
}
