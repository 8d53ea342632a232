-- A chest of one tray, open by 50 mm, with a block in it. The expert reads its parts and joints.
local solids = require "solids"
local block = solids.solid("block", { 0.03, 0.03, 0.03 }, softvt.rigid { density = 500 })
local slab = softvt.shape.box { size = { 0.1, 0.1, 0.01 } }
local slider = softvt.slider { axis = { 0, -1, 0 }, lower = 0, upper = 0.08, damping = 2, friction = 1 }
local tray = { name = "tray", shape = slab:translate(0, 0, 0.02), density = 500, joint = slider }
local chest = softvt.asset {
  name = "chest",
  shape = slab:grounded(),
  body = softvt.articulated { parts = { tray } },
}
local layout = softvt.layout("one", function(scene)
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "chest", asset = chest, at = { 0, 0.1 }, joints = { tray = 0.05 } }
  scene:add { name = "block", asset = block, at = { 0, 0.03 }, on = "chest.tray" }
  assert(scene:object("chest").joints.tray == 0.05)
end)
return softvt.suite {
  name = "one",
  object_type = "rigid",
  tasks_differ_in = "spatial",
  episodes = 1,
  tasks = {
    softvt.task {
      prompt = "wait",
      layout = layout,
      budget_steps = 40,
      goal = softvt.on { object = "block", target = "chest" },
      expert = function(arm, scene)
        local seen = scene:object "chest"
        assert(math.abs(seen.joints.tray - 0.05) < 1e-5 and seen.joint == nil)
        local part = scene:part("chest", "tray")
        assert(part.name == "tray" and part.joint == seen.joints.tray and seen.parts.tray.joint == part.joint)
        assert(math.abs(part.centre[2] - 0.05) < 1e-5 and math.abs(part.size[1] - 0.1) < 1e-9)
        assert(#scene:objects() == 3, "parts are no objects of their own")
        error "all seen"
      end,
    },
  },
}
