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

scene:add { name = 'chest', asset = chest, at = { 1, 0 }, yaw = math.pi, joints = { drawer = 0.08 } }
scene:add { name = 'moved', asset = small.ball, at = { 1, 0.1 }, on = 'chest.drawer' }
scene:add { name = 'fixed', asset = small.ball, at = { 1, -0.03 }, on = 'chest' }
assert(math.abs(scene:object('moved').position[3] - 0.065) < 1e-6, 'on the drawer')
assert(math.abs(scene:object('fixed').position[3] - 0.03) < 1e-6, 'beside it, on the base')

local drawer = { name = 'drawer', shape = box:translate(0, 0, 0.05), density = 500, joint = softvt.slider { axis = { 0, -1, 0 }, lower = 0, upper = 0.1 } }
local high = { name = 'high', shape = box:translate(0, 0, 0.1), density = 1000, joint = drawer.joint }
local two = softvt.asset { name = 'two', shape = box:grounded(), body = softvt.articulated { parts = { drawer, high } } }
local block = softvt.asset { name = 'block', shape = box:grounded(), body = softvt.rigid { density = 100 } }
local wall = softvt.asset { name = 'wall', shape = box:grounded(), body = softvt.static {} }
for i, asset in ipairs { two, block, wall } do scene:add { name = asset.name, asset = asset, at = { i, 0 } } end
for _, object in ipairs(scene.objects) do object:scale_mass(2) end
local two, block, wall = scene:object 'two', scene:object 'block', scene:object 'wall'
assert(math.abs(two:mass() - 0.9) < 1e-9 and math.abs(two:mass 'drawer' - 0.3) < 1e-9, two:mass())
assert(math.abs(block:mass() - 0.06) < 1e-9 and wall:mass() == nil, block:mass())
two:mass 'drawr'

scene:add { name = 'chest', asset = chest, at = { 1, 0 }, joints = { drawer = 0.04 } }
assert(scene:object('chest').joints.drawer == 0.04)

scene:add { name = 'chest', asset = chest, at = { 1, 0 } }
assert(scene:object('chest').joints.drawer == 0)
