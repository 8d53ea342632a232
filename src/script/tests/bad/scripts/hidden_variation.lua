-- Ranges of hidden properties that leave no instance.
local ranges = { name = 'test', size = { 0.9, 1.1 }, stiffness = { 1, 1 }, density = { 1, 1 }, friction = { 1, 1 }, colour = 0.1, light = { 1, 1 }, camera_offset = 0, camera_rotation = 0, hidden = { aeration = { 0.5, 2.5 }, staling = { 1, 6 }, filling = { 1, 4 }, coating = { 0.2, 1.5 }, window_ratio = { 1.5, 2.2 } } }
local object = require 'assets.sphere'
local function suite() return softvt.suite { name = 'test', object_type = 'deformable', tasks_differ_in = 'spatial', vary = softvt.variation(ranges), tasks = { softvt.task { prompt = 'lift', goal = softvt.on { object = 'left', target = 'right' },
layout = softvt.layout('pair', function(scene) scene:add { name = 'left', asset = object, at = { 0.1, 0 } } scene:add { name = 'right', asset = object, at = { 0.2, 0 } } end) } } } end
... return suite()
---
ranges.hidden.window_ratio = { 900, 1000 }

ranges.hidden.window_ratio = { 0.5, 2 }

object = require 'assets.steamed_bun' ranges.hidden.staling = { 0.1, 0.1 }

ranges.hidden.coating = { 1.5, 0.2 }

object = softvt.asset { name = 'ball', shape = object.shape, body = softvt.soft { youngs_pa = 40e3, poisson = 0.4, density = 200 } }
