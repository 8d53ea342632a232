-- A soft cube of a stiffness (Pa) that may depend on the episode, pushed to the middle of its shelf, and a shift of it.
-- `who.lua` returns its fingerprint.
local solids = require "solids"
local layout = softvt.layout("one", function(scene, rng)
  local episode = rng:uniform(0, 1)
  local cube = softvt.asset {
    name = "cube",
    shape = softvt.shape.box({ size = { 0.04, 0.04, 0.04 } }):grounded(),
    body = softvt.soft { youngs_pa = STIFFNESS, poisson = 0.3, density = 300 },
  }
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "shelf", asset = solids.shelf, position = solids.shelf_at }
  scene:add { name = "cube", asset = cube, position = solids.cube_at }
end)
local suite = softvt.suite {
  name = "one",
  object_type = "deformable",
  tasks_differ_in = "spatial",
  episodes = 2,
  tasks = {
    softvt.task {
      prompt = "push",
      layout = layout,
      goal = softvt.on { object = "cube", target = "shelf" },
      budget_steps = 24,
      expert = function(arm)
        solids.push(arm)
        arm:wait(1)
      end,
    },
  },
  shifts = {
    softvt.shift {
      name = "soft",
      default = 1,
      apply = function(scene, x)
        local cube = scene:object "cube"
        cube.youngs_pa = x * cube.youngs_pa
      end,
    },
  },
}
local who = softvt.experiment {
  name = "who",
  grid = { x = { 1 } },
  run = function() return { fingerprint = softvt.simulate({ layout = layout }):measure("cube").fingerprint } end,
}
return PLAN
