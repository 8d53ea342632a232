-- Suites whose objects cannot vary, or vary beyond what a hand can hold.
local ball, mat = softvt.shape.sphere { radius = 0.03 }:grounded(), softvt.asset { name = 'mat', shape = softvt.shape.box { size = { 0.2, 0.2, 0.01 } }:grounded(), body = softvt.static {} }
local soft = softvt.asset { name = 'ball', shape = ball, body = softvt.soft { youngs_pa = 40e3, poisson = 0.4, density = 200 } }
local rigid = softvt.asset { name = 'ball', shape = ball, body = softvt.rigid { density = 200 } }
local ranges = { name = 'test', size = { 0.9, 1.1 }, stiffness = { 0.5, 2 }, density = { 0.6, 1.8 }, friction = { 0.7, 1.4 }, colour = 0.1, light = { 0.7, 1.4 }, camera_offset = 0.01, camera_rotation = 0.02 }
local function pair(asset) return function(scene) scene:add { name = 'mat', asset = mat, at = { 0.3, 0 } } for k, name in ipairs { 'left', 'right' } do scene:add { name = name, asset = asset, at = { 0.1 * k, 0 } } end end end
local function suite(build, vary, type) return softvt.suite { name = 'test', object_type = type or 'deformable', tasks_differ_in = 'spatial', vary = vary, tasks = { softvt.task { prompt = 'lift', layout = softvt.layout('pair', build), goal = softvt.on { object = 'left', target = 'mat' } } } } end
---
return suite(pair(soft), softvt.variation(ranges))

return suite(pair(rigid), softvt.variation(ranges), 'rigid')

return suite(pair(rigid), softvt.variation(ranges))

ranges.size = { 1.1, 0.9 } return suite(pair(soft), softvt.variation(ranges))

ranges.size = nil return suite(pair(soft), softvt.variation(ranges))

ranges.size = { 0.9, 1.5 } return suite(pair(soft), softvt.variation(ranges))

return suite(function(scene) pair(soft)(scene)
  scene:object('left').scale = 1.4 end)
