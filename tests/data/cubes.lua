-- Soft cubes of two assets on a shelf, for which calibrations are written by the fingerprints that the plan `who`
-- returns. The layout `drawn` places one of the two, and the layout `changed` runs a CHANGE on a cube.
local solids = require "solids"
local function asset(name, edge)
  return softvt.asset {
    name = name,
    shape = softvt.shape.box({ size = { edge, edge, edge } }):grounded(),
    body = softvt.soft { youngs_pa = 2e4, poisson = 0.3, density = 300 },
  }
end
local assets = { cube = asset("cube", 0.04), small = asset("small", 0.03) }
local function layout(name, place)
  return softvt.layout(name, function(scene, rng)
    scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
    scene:add { name = "shelf", asset = solids.shelf, position = solids.shelf_at }
    place(scene, rng:uniform(0, 1))
  end)
end
local function add(scene, name) scene:add { name = "cube", asset = assets[name], position = solids.cube_at } end
local drawn = layout("drawn", function(scene, u) add(scene, u < 0.5 and "cube" or "small") end)
local changed = layout("changed", function(scene, u)
  add(scene, "cube")
  local cube = scene:object "cube"
  -- CHANGE
end)
local function task(of)
  return softvt.task {
    prompt = of.name,
    layout = of,
    goal = softvt.on { object = "cube", target = "shelf" },
    budget_steps = 24,
    expert = function(arm)
      solids.push(arm)
      arm:wait(1)
    end,
  }
end
local suite = softvt.suite {
  name = "one",
  object_type = "deformable",
  tasks_differ_in = "spatial",
  episodes = 4,
  tasks = { task(drawn), task(changed) },
}
local plain = {
  cube = layout("cube", function(scene) add(scene, "cube") end),
  small = layout("small", function(scene) add(scene, "small") end),
}
local who = softvt.experiment {
  name = "who",
  grid = { asset = { "cube", "small" } },
  run = function(point)
    local fingerprint = softvt.simulate({ layout = plain[point.asset] }):measure("cube").fingerprint
    return { asset = point.asset, fingerprint = fingerprint }
  end,
}
return suite
