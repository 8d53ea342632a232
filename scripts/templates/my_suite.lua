-- A suite: what is asked, where things stand, when it is done, and who can do it.
--
--   softvt check suites/my_suite.lua     is it right?
--   softvt suites/my_suite.lua           the expert does it
--   softvt view suites/my_suite.lua --out seen
local arrange = require "layouts.arrange"
local pick_place = require "experts.pick_place"
local scenery = require "scenery"
local shifts = require "shifts"

local mm = 1e-3
local objects = { thing = require "assets.my_object", plate = require "assets.plate", table = require "assets.table" }

-- Where things stand at the start of an episode. Everything random comes from rng, so that an episode's number says it all.
-- z = 0 is the top of the table, the robot's base is at x = -0.66, and +y is to the right in the picture.
local layout = softvt.layout("my_layout", function(scene, rng)
  scene:add { name = "table", asset = objects.table, xyz = { 0, 0, 0 } }
  arrange.add(scene, rng, {
    { name = "plate", asset = objects.plate, at = { 40 * mm, 120 * mm } },
    { name = "thing", asset = objects.thing, at = { -40 * mm, -120 * mm }, reach = 20 * mm, turn = math.rad(30) },
  }, 20 * mm)
  scenery.table_room(scene)
  arrange.arm(scene, rng)
end)

return softvt.suite {
  name = "my_suite",
  object_type = "deformable", -- or "rigid"
  variation = "object",       -- or "spatial": what differs between the tasks
  episodes = 5,
  tasks = {
    softvt.task {
      prompt = "pick up the loaf and place it on the plate",
      layout = layout,
      -- Done once the thing has lain on the plate, let go of, for 0.4 s; softvt.inside is for baskets.
      goal = softvt.on { object = "thing", target = "plate", hold_s = 0.4 },
      expert = pick_place { object = "thing", target = "plate" },
    },
  },
  shifts = shifts.soft,
}
