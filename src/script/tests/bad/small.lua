-- A suite of a ball and a mat, whose parts a fixture replaces.
local small = {
  mat = softvt.asset {
    name = "mat",
    shape = softvt.shape.box { size = { 0.1, 0.1, 0.01 } }:grounded(),
    body = softvt.static {},
  },
  ball = softvt.asset {
    name = "ball",
    shape = softvt.shape.sphere { radius = 0.03 }:grounded(),
    body = softvt.soft { youngs_pa = 40e3, poisson = 0.4, density = 200 },
  },
  goal = softvt.on { object = "ball", target = "mat" },
}

-- A layout that calls `build` first.
function small.layout(build)
  return softvt.layout("one", function(scene, rng)
    if build then build(scene, rng) end
    scene:add { name = "ball", asset = small.ball, at = { rng:uniform(-0.02, 0.02), rng:uniform(-0.02, 0.02) } }
    scene:add { name = "mat", asset = small.mat, at = { 0.3, 0 } }
  end)
end

-- The suite with these parts; `build` is called before its layout.
function small.suite(parts)
  return softvt.suite {
    name = "test",
    object_type = "deformable",
    tasks_differ_in = "spatial",
    shifts = parts.shifts,
    tasks = {
      softvt.task {
        prompt = parts.prompt or "lift the ball",
        layout = parts.layout or small.layout(parts.build),
        expert = parts.expert,
        episode_prompt = parts.episode_prompt,
        goal = parts.goal or small.goal,
      },
    },
  }
end

return small
