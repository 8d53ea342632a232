-- Goals of objects that are not in the scene, cannot move or cannot be touched.
local small = require 'small' local box = softvt.shape.box { size = { 0.1, 0.1, 0.01 } }:grounded()
local chest = softvt.asset { name = 'chest', shape = box, body = softvt.articulated { parts = { { name = 'top_drawer', shape = box:translate(0, 0, 0.05), density = 500, joint = softvt.slider { axis = { 0, 1, 0 }, lower = 0, upper = 0.1 } } } } }
local sky = softvt.asset { name = 'sky', shape = box, body = softvt.scenery {} }
return small.suite { goal = ..., build = function(scene) scene:add { name = 'chest', asset = chest, at = { 1, 0 } } scene:add { name = 'sky', asset = sky, at = { 2, 0 } } end }
---
softvt.on { object = 'ball', target = 'chest.top_drawer' }

softvt.on { -- a comment
  object = 'bal',
  target = 'mat' }

softvt.on {
  object = 'ball',
  target = 'chest.top' }

softvt.on { object = 'mat', target = 'ball' }

softvt.on { object = 'chest', target = 'ball' }

softvt.on { object = 'sky', target = 'ball' }

softvt.on { object = 'ball',
  target = 'sky' }
