-- A placed chest: start values of its joints, and objects on its parts.
local small, box = require 'small', softvt.shape.box { size = { 0.1, 0.1, 0.03 } }
local function chest(drawer) return softvt.asset { name = 'chest', shape = box:grounded(), body = softvt.articulated { parts = { { name = 'drawer', shape = drawer, density = 500, joint = softvt.slider { axis = { 0, -2, 0 }, lower = 0, upper = 0.1, friction = 1 } } } } } end
local chest = chest(box:translate(0, 0, 0.05))
return small.suite { build = function(scene) ... end }
---
scene:add { name = 'chest', asset = chest, at = { 1, 0 }, joints = { drawer = 0.04 } }

scene:add { name = 'chest', asset = chest, at = { 1, 0 },
  joints = { drawer = 0.2 } }

scene:add { name = 'chest', asset = chest, at = { 1, 0 }, joints = { draw = 0 } }

scene:add { name = 'chest', asset = small.ball, at = { 1, 0 }, joints = { drawer = 0 } }

scene:add { name = 'chest', asset = chest, at = { 1, 0 } }
scene:add { name = 'low', asset = small.ball, at = { 1, 0.1 }, on = 'chest.drawr' }

scene:add { name = 'chest', asset = chest, at = { 1, 0 }, scale = 1.1 }
