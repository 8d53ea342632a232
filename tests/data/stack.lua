-- A push moves the object `upper` to the middle of `lower`, on which it rests, on a pillar. UPPER and LOWER are bodies.
local soft, rigid, static =
  softvt.soft { youngs_pa = 3e4, poisson = 0.3, density = 300 }, softvt.rigid { density = 300 }, softvt.static {}
local solids = require "solids"
local x, y, z = table.unpack(solids.shelf_at)
local layout = softvt.layout("stack", function(scene)
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "pillar", asset = solids.solid("pillar", { 0.06, 0.14, 0.225 }, static), position = solids.shelf_at }
  scene:add { name = "lower", asset = solids.solid("lower", { 0.06, 0.14, 0.04 }, LOWER), position = { x, y, 0.225 } }
  scene:add {
    name = "upper",
    asset = solids.solid("upper", { 0.04, 0.04, 0.04 }, UPPER),
    position = { x, y + 0.034, 0.2651 },
  }
  scene:add { name = "far", asset = solids.solid("far", { 0.04, 0.04, 0.04 }, rigid), position = { 0, -0.2, 0 } }
end)
local function task(on)
  return softvt.task {
    prompt = on,
    layout = layout,
    goal = softvt.on { object = "upper", target = on },
    budget_steps = 24,
    expert = function(arm)
      solids.push(arm)
      arm:wait(1)
    end,
  }
end
return softvt.suite {
  name = "stack",
  object_type = "deformable",
  tasks_differ_in = "spatial",
  episodes = 1,
  tasks = { task "lower", task "far" },
}
