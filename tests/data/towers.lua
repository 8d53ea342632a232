-- A tower of three upright blocks. The offset of the second from the first is noted before the third is placed.
local pick_place, sequence = require "experts.pick_place", require "experts.sequence"
local function block(name, edge)
  local shape = softvt.shape.box { size = { edge, edge, 2 * edge } }:grounded()
  return softvt.asset { name = name, shape = shape, body = softvt.rigid { density = 400 } }
end
local floor = softvt.asset {
  name = "floor",
  shape = softvt.shape.box { size = { 3, 3, 0.05 } }:translate(0, 0, -0.025),
  body = softvt.static {},
}
local wide, middle, narrow = block("wide", 0.04), block("middle", 0.036), block("narrow", 0.03)
local function near(at) return at + 0.02 * (2 * math.random() - 1) end
local layout = softvt.layout("blocks", function(scene)
  scene.base = { -0.6, 0, 0 }
  scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
  scene:add { name = "wide", asset = wide, position = { near(0), near(0.15), 0 } }
  scene:add { name = "middle", asset = middle, position = { near(-0.05), near(0), 0 } }
  scene:add { name = "narrow", asset = narrow, position = { near(0.03), near(-0.15), 0 } }
end)
local function task(prompt, stack)
  return softvt.task {
    prompt = prompt,
    layout = layout,
    object = "narrow",
    budget_steps = 900,
    goal = softvt.stacked { objects = { "wide", "middle", "narrow" } },
    expert = sequence {
      pick_place { object = "middle", target = "wide", stack = stack },
      function(arm, scene)
        local a, b = scene:object("middle").centre, scene:object("wide").centre
        arm:note("offset_mm", 1e3 * math.sqrt((a[1] - b[1]) ^ 2 + (a[2] - b[2]) ^ 2))
      end,
      pick_place { object = "narrow", target = "middle", stack = stack },
    },
  }
end
return softvt.suite {
  name = "towers",
  object_type = "rigid",
  tasks_differ_in = "spatial",
  episodes = 2,
  tasks = { task("build a tower", true), task("build a tower at once", false) },
}
