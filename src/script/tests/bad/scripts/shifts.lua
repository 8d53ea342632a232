-- Functions of shifts.
local small = require 'small'
return small.suite { shifts = { softvt.shift { name = 'stiffness', default = 1, min = 0.1, apply = function(scene, value) ... end } } }
---
-- shift: stiffness=0.5
local ball = scene:object 'ball'
ball.youngs_pa = ball.youngs_pa * value
assert(ball.youngs_pa == 20e3)

-- shift: stifness=0.5
return scene

-- shift: stiffness=0.5
scene:object('ball').youngs = 1

-- shift: stiffness=0.5
scene:object('ball').poisson = value

-- shift: stiffness=0.5
scene.gravty = { 0, 0, 0 }
