-- Actions that end the run at the line of act, and observations that a policy lacks.
local POSE = { position = { 0.5, 0, 0.25 }, axis_angle = { 3, 0, 0 } }
return softvt.policy { name = 'p', observes = { cameras = { 'wrist' }, tactile = true, drives = true }, act = function(obs) ... end }
---
return { position = obs.position, axis_angle = obs.axis_angle, closure = obs.closure }

return

return 'left'

return {}

return { 1, 2 }

return { positon = { 0, 0, 0 }, closure = 0 }

return { position = { 0, 0 }, closure = 0 }

return { position = { 0, 0, 0 }, closure = 0 }

return { closure = 0 }

return { joints = { 0, 0 }, closure = 0 }

return { position = { 0, 0, 0 }, joints = { 0, 0, 0, 0, 0, 0, 0 }, closure = 0 }

return { position = { 0, 0, 0 }, axis_angle = { 0, 0, 0 }, closure = 2 }

return { position = { 0, 0, 0 }, axis_angle = { 0, 0, 0 }, closure = 0, force = 1 }

return { position = { 0, 0, 0 }, quaternion = { 0, 0, 0, 0 }, closure = 1 }

return { position = { 0/0, 0, 0 }, axis_angle = { 0, 0, 0 }, closure = 0 }

return { position = { 0, 0, 0 }, axis_angle = { 0, 0, 0 }, closure = 1/0 }

return { { position = { 0, 0, 0 }, quaternion = { 1, 0, 0, -1/0 }, closure = 0 } }

error 'lost'

return obs.positon

return obs:camera 'wirst'

return obs.force

obs.time = 3

-- A limit that is asked for in an episode.
return softvt.calibration('cube').tau

while true do end

local t = {} for i = 1, 1e9 do t[i] = { i } end
