-- Actions of each form and grip code.
local POSE = { position = { 0.5, 0, 0.25 }, axis_angle = { 3, 0, 0 } }
local function policy(gripper, action) for key, value in pairs(POSE) do action[key] = value end return softvt.policy { name = 'p', gripper = gripper, act = function() return action end } end
---
return policy(nil, { closure = 0.6 })

return policy(nil, { force = 2.5 })

return policy('continuous', { closure = 0.6 })

return policy('binary', { closure = 0.6 })

return policy('binary', { closure = 0.5 })

return policy('two-width', { closure = 0.6 })

return policy('force', { force = 2.5 })

-- gripper: two-width
return policy('binary', { closure = 0.6 })

-- gripper: binary
return policy(nil, { closure = 0.6 })

-- gripper: force
return policy(nil, { closure = 0.6 })

return softvt.policy { name = 'p', act = function()
  local a = { position = { 0.5, 0, 0.25 }, quaternion = { 0, 2, 0, 0 }, closure = 0.5 } return { a, a } end }

return softvt.policy { name = 'p', act = function()
  return { joints = { 0, -0.2, 0, -2.4, 0, 2.2, 0.8 }, closure = 1 } end }
