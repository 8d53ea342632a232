-- The fingers close on a block on a pillar, and their fronts push a bar to the middle of its shelf.
local solids = require "solids"
local pillar = solids.solid("pillar", { 0.03, 0.03, 0.28 }, softvt.static {})
local block = solids.solid("block", { 0.03, 0.05, 0.04 }, softvt.rigid { density = 300 })
local shelf = solids.solid("shelf", { 0.11, 0.08, 0.262 }, softvt.static {})
local bar = solids.solid("bar", { 0.04, 0.12, 0.04 }, softvt.rigid { density = 300 })
local layout = softvt.layout("one", function(scene)
  scene.base = { -0.6, 0, 0 }
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "pillar", asset = pillar, position = { -0.137, -0.005, 0 } }
  scene:add { name = "block", asset = block, position = { -0.127, -0.005, 0.28 } }
  scene:add { name = "shelf", asset = shelf, position = { -0.044, -0.005, 0 } }
  scene:add { name = "bar", asset = bar, position = { -0.088, -0.005, 0.262 } }
end)
local function task(prompt)
  return softvt.task {
    prompt = prompt,
    layout = layout,
    budget_steps = 40,
    goal = softvt.on { object = "bar", target = "shelf" },
    expert = function(arm, scene)
      arm:grasp(0.6, { rate = 1 })
      arm:move_by({ 0.02, 0, 0 }, { speed = 0.2 })
      arm:move_by({ -0.015, 0, 0 }, { speed = 0.2 })
      arm:wait(1)
    end,
  }
end
return softvt.suite {
  name = "one",
  object_type = "rigid",
  tasks_differ_in = "spatial",
  episodes = 1,
  tasks = { task("wait a while"), task("wait for it") },
}
