-- What the function of a layout does with its scene.
local small, arrange, plate = require 'small', require 'layouts.arrange', require 'assets.plate' local sky = softvt.asset { name = 'sky', shape = small.mat.shape, body = softvt.scenery {} }
return small.suite { build = function(scene, rng) ... end }
---
scene.base[1] = 'a'

scene.base[1] = 0/0

scene.base[4] = 1

scene.base.x = 1

local _ = scene.base.x

table.insert(scene.base, 1)

scene.base = { 1e300, 0, 0 }

scene.base = { 999, 0, 0 }

scene.workspace_min = { -0.5, -0.6, -0.05 }

scene.workspace_min = { 0, 0.7, 0 }

scene.start_q = { 0, 0, 0, 0.5, 0, 2, 0 }

scene.start_q[2] = 1.8

scene.start_q = { 0, 0, 0, -2, 0, 2, 0 }

scene.light.colour = { 1, 0.5, 0.25 } scene.light.colour[1] = -1

scene.light.strength = -1

scene.light.brightness = 1

scene.light.direction = { 0, 0, 0 }

scene.light.direction = { 0, 0/0, 1 }

scene.light = 'x'

scene.objects[1] = 3

scene.objects = {}

scene.add = 1

scene.add {}

scene:camera('wirst').width = 64

scene:camera('wrist').width = 0

scene:camera('wrist').height = 100000

scene:camera('wrist').position = { 0/0, 0, 0 }

scene:camera('wrist').quaternion[1] = 0

scene:camera('wrist').quaternion = { 0, 0, 0, 0 }

scene:camera('wrist'):look_at('abc')

scene:camera('wrist'):look_at { 0, 0/0, 1 }

scene:camera('wrist'):look_at { 0, 1e7, 1 }

scene:camera('wrist'):look_at({ 0, 0, 1 }, { 0, 0, 0 })

scene:add_camera { name = 'top', position = { 0, 0, 1 }, look_at = { 0, 0, 0 } }

scene:add_camera { name = 'wrist', position = { 0, 0, 1 }, look_at = { 1, 0, 0 } }

softvt.pose { position = { 0, 0, 0 } }.position[1] = 1

softvt.pose { position = { 0, 0, 0 }, quaternion = { 1e-300, 0, 0, 0 } }

local _ = softvt.image { width = 1, height = 1, colour = { 0, 0, 0 } }.widht

scene:add { name = 'cube', asset = small.ball, at = { 0.1, 0 } }
scene:object('cube').materials[1].albedo = { 2, 0, 0 }

scene:add { name = 'cube', asset = small.ball, at = { 0.1, 0 } }
scene:object('cube').materials[1].shine = 2

arrange.add(scene, rng, { { name = 'a', asset = plate, at = { 0, 0, 0.2 } } }, 0.02)

arrange.add(scene, rng, { { name = 'a', asset = plate, at = { 0, 0 }, position_range = -0.02 } }, 0.02)

scene:add { name = 'low', asset = small.ball, at = { 0.1, 0 } }
scene:add { name = 'high', asset = small.ball, at = { 0.3, 0 }, on = 'low' }

scene:add { name = 'bun', position = { 0, 0, 0 }, asset = softvt.asset { name = 'bun', body = softvt.scenery {},
  shape = small.ball.shape:paint { material = 2, region = softvt.shape.sphere { radius = 0.01 } },
  visuals = { { albedo = { 1, 1, 1 } }, { albedo = { 1, 1, 1 } } } } }

-- Objects of one asset, one on the other.
scene:add { name = 'low', asset = small.ball, at = { 0.1, 0 } }
scene:add { name = 'high', asset = small.ball, at = { 0.1, 0 }, on = 'low' }
assert(math.abs(scene:object('high').position[3] - 0.06) < 1e-6)

-- Without visuals, a painted shape gets one for each material.
local shape = small.ball.shape:paint { material = 2, region = softvt.shape.sphere { radius = 0.01 } }
scene:add { name = 'bun', asset = softvt.asset { name = 'bun', body = softvt.scenery {}, shape = shape }, position = { 0, 0, 0 } }
assert(#scene:object('bun').materials == 3)

local shape = small.ball.shape:paint { material = 2, region = softvt.shape.sphere { radius = 0.01 } }
local look = { albedo = { 1, 1, 1 } }
scene:add { name = 'bun', position = { 0, 0, 0 },
  asset = softvt.asset { name = 'bun', body = softvt.scenery {}, shape = shape, visuals = { look, look, look } } }
assert(#scene:object('bun').materials == 3)
