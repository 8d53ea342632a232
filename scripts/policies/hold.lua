-- Keeps its pose with the gripper open: a minimal policy to start from.
--
--   softvt suites/object_soft.lua --policy scripts/policies/hold.lua --episodes 1
local pose

return softvt.policy {
  name = "hold",
  reset = function() pose = nil end,
  act = function(obs)
    pose = pose or { position = obs.position, axis_angle = obs.axis_angle }
    return { position = pose.position, axis_angle = pose.axis_angle, closure = 0 }
  end,
}
