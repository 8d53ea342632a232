local mat = softvt.asset { name = "mat", shape = softvt.shape.box { size = { 0.1, 0.1, 0.01 } }:grounded(), body = softvt.static {} }
local ball = softvt.asset {
  name = "ball", shape = softvt.shape.sphere { radius = 0.03 }:grounded(),
  body = softvt.soft { youngs_pa = 40e3, poisson = 0.4, density = 200 },
}
local layout = softvt.layout("one", function(scene, rng)
  scene:add { name = "ball", asset = ball, at = { rng:uniform(-0.02, 0.02), rng:uniform(-0.02, 0.02) } } scene:add{ name = "mat", asset = mat, at = { 0.3, 0 } }
end)
local function suite(expert, shifts)
  return softvt.suite {
    name = "test", object_type = "deformable", tasks_differ_in = "spatial", shifts = shifts,
    tasks = { softvt.task {
      prompt = "lift the ball", layout = layout, expert = expert,
      goal = softvt.on { object = "ball", target = "mat" },
    } },
  }
end
