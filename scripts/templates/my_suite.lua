-- A suite: tasks with a prompt, a layout, a goal and an expert.
--
--   softvt check suites/my_suite.lua     reports errors
--   softvt suites/my_suite.lua           runs the expert
--   softvt view suites/my_suite.lua --out seen
local arrange = require "layouts.arrange"
local pick_place = require "experts.pick_place"
local scenery = require "scenery"
local shifts = require "shifts"

local mm = 1e-3
local assets = { loaf = require "assets.my_object", plate = require "assets.plate", table = require "assets.table" }

-- The initial scene of an episode. All random numbers come from rng, so the index of an episode determines it.
-- z = 0 is the top of the table, the robot's base is at x = -0.66, and +y is to the right in the third-person image.
local layout = softvt.layout("my_layout", function(scene, rng)
  scene:add { name = "table", asset = assets.table, position = { 0, 0, 0 } }
  arrange.add(scene, rng, {
    { name = "plate", asset = assets.plate, at = { 40 * mm, 120 * mm } },
    {
      name = "loaf",
      asset = assets.loaf,
      at = { -40 * mm, -120 * mm },
      position_range = 20 * mm,
      yaw_range = math.rad(30),
    },
  }, 20 * mm)
  scenery.table_room(scene)
  arrange.arm(scene, rng)
end)

return softvt.suite {
  name = "my_suite",
  object_type = "deformable", -- or "rigid"
  tasks_differ_in = "object", -- or "spatial": what differs between the tasks
  episodes = 5,
  tasks = {
    softvt.task {
      prompt = "pick up the loaf and place it on the plate",
      layout = layout,
      -- Reached once the loaf has rested on the plate, released, for 0.4 s. Use softvt.inside for containers.
      goal = softvt.on { object = "loaf", target = "plate", hold_s = 0.4 },
      expert = pick_place { object = "loaf", target = "plate" },
    },
  },
  shifts = shifts.soft,
}
