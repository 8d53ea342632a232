-- Experts that fail, and what they learn of the scene.
local small, places = require 'small', require 'experts.places'
return small.suite { expert = function(arm, scene) ... end }
---
arm:wait(0.2)

local x = nil .. 1

coroutine.yield(3)

return arm:move_by({ 0, 0, 0.01 }, { speed = 100 }) -- A tail call.

arm:open { rate = 1e9 }

arm:grasp(0.2, { width = 0.03 })

softvt.pose { position = { 0, 0, 0.2 }, yaw = 1, quaternion = { 0, 1, 0, 0 } }

scene:part('ball', 'knob')

-- Not at a line of the library.
local _ = places.state(scene, 'bal')

while true do end

scene:object 'bal'

arm:move_to(arm.pose, { sped = 1 })

arm:close_to(2)

arm:mov_to(1)

arm:give_up()

local over = softvt.pose { position = { 0.1, 0, 0.5 }, yaw = 0 }
local on = softvt.pose { position = { 0.1, 0, 0.06 }, yaw = 0 }
local far, none = scene:clearance(over)
local near, ball = scene:clearance(on, { width = 0.02 })
assert(far == 0.2 and none == nil, tostring(far))
assert(near < 0 and ball == 'ball', tostring(near))
assert(scene:clearance(on, { ignore = { 'ball' } }) == 0.2)
scene:clearance(on, { ignore = { 'bal' } })

local down = softvt.pose { position = { -0.15, 0.1, 0.2 }, quaternion = { 0, 1, 0, 0 } }
local near, none = arm:reaches(down)
local far, miss = arm:reaches(down:at { 1.2, 0, 0.2 })
assert(near and none == 0 and not far and miss > 0.5 and miss < 1.5, miss)
