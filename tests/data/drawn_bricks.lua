-- Four episodes with a brick whose hidden properties are drawn.
local brick = require "assets.brick"
local floor = softvt.asset {
  name = "floor",
  shape = softvt.shape.box { size = { 1, 1, 0.05 } }:translate(0, 0, -0.025),
  body = softvt.static {},
}
local layout = softvt.layout("one", function(scene)
  scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
  scene:add { name = "brick", asset = brick, at = { 0, 0.1 } }
  scene:add { name = "post", asset = floor, position = { 0, 2, 0 } }
end)
return softvt.suite {
  name = "one",
  object_type = "deformable",
  tasks_differ_in = "spatial",
  episodes = 4,
  tasks = {
    softvt.task {
      prompt = "wait",
      layout = layout,
      goal = softvt.on { object = "brick", target = "post" },
      budget_steps = 1,
    },
  },
  vary = softvt.variation {
    name = "test",
    size = { 0.9, 1.1 },
    stiffness = { 1, 1 },
    density = { 1, 1 },
    friction = { 1, 1 },
    colour = 0,
    light = { 1, 1 },
    camera_offset = 0,
    camera_rotation = 0,
    hidden = {
      aeration = { 0.5, 2.5 },
      staling = { 1, 6 },
      filling = { 1, 4 },
      coating = { 0.2, 1.5 },
      window_ratio = { 1.2, 3 },
    },
  },
}
