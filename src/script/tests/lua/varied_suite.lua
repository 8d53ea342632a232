-- The assets and the suite that tests of variations begin with.
local mat = softvt.asset { name = "mat", shape = softvt.shape.box { size = { 0.2, 0.2, 0.01 } }:grounded(), body = softvt.static {} }
local function ball(body)
  return softvt.asset { name = "ball", shape = softvt.shape.sphere { radius = 0.03 }:grounded(), body = body, hints = { grasp_height_m = 0.03 } }
end
local soft = ball(softvt.soft { youngs_pa = 40e3, poisson = 0.4, density = 200 })
local rigid = ball(softvt.rigid { density = 200 })
local ranges = { name = "test", size = { 0.9, 1.1 }, stiffness = { 0.5, 2 }, density = { 0.6, 1.8 }, friction = { 0.7, 1.4 }, colour = 0.1,
  light = { 0.7, 1.4 }, camera_offset = 0.01, camera_rotation = 0.02 }
local function suite(build, vary, type)
  local layout = softvt.layout("pair", function(scene, rng)
    scene:add { name = "mat", asset = mat, at = { 0.3, 0 } }
    build(scene, rng)
  end)
  local function task(name)
    return softvt.task { prompt = "lift " .. name, layout = layout, goal = softvt.on { object = name, target = "mat" } }
  end
  return softvt.suite { name = "test", object_type = type or "deformable", tasks_differ_in = "spatial", vary = vary, tasks = { task "left", task "right" } }
end
local function pair(scene, rng)
  for k, name in ipairs { "left", "right" } do scene:add { name = name, asset = soft, at = { 0.1 * k + rng:uniform(0, 0.01), 0 } } end
end
