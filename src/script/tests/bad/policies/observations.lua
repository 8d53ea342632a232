-- Values of an observation, which the simulation gave.
local POSE = { position = { 0.5, 0, 0.25 }, axis_angle = { 3, 0, 0 }, closure = 0 }
return softvt.policy { name = 'p', observes = { cameras = { 'wrist' }, tactile = true, drives = true }, act = function(obs) ... return POSE end }
---
assert(obs.time == 1.5 and obs.width == 0.0625 and obs.closure == 0.25 and obs.prompt == 'take it')

assert(obs.position[2] == -0.125 and #obs.position == 3 and #obs.joints == 7 and obs.joints[4] == -2)

assert(math.abs(obs.axis_angle[1] - math.pi) < 1e-12 and math.abs(obs.quaternion[2] - 1) < 1e-12)

local image = obs:camera 'wrist' assert(image.width == 8 and image.height == 6)

local p = obs:camera('wrist'):pixel(2, 1) assert(p[1] == 10 and p[2] == 20 and p[3] == 30)

local m = obs:camera('wrist'):mean { 2, 1, 1, 1 } assert(m[3] == 30)

local m = obs.tactile.left.markers:mean() assert(m[1] == -0.5 and m[2] == 0.25)

assert(obs.tactile.right.markers:outward_shear() == 0 and obs.tactile.left.markers:rms_residual() < 1e-6)

local mask = obs.tactile.left.markers:contact_mask(0.5) assert(#mask == 99 and mask[1] and mask[99])

assert(obs.tactile.left.markers:contact_share(0.5) == 1 and obs.tactile.left.markers:contact_share(0.6) == 0)

local m = obs.tactile.left.markers
assert(m.motion[99][2] == 0.25 and m.initial[1][1] == 15 and m.present[1][1] == 14.5)

local c = obs.tactile.left.difference:mean() assert(c[1] == 40 and c[2] == 0 and c[3] == 40)

assert(#obs.tactile_history == 2 and obs.tactile_history[1].left.markers:max_displacement() == 0)

assert(obs.time == 2, 'an assertion that fails')
