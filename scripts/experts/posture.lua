-- Changes between a hand that points down and a hand in another orientation.
local posture = {}

-- Time after which the arm has arrived, s, and the largest distance from a pose where it has, m.
local SETTLE, ARRIVED = 0.2, 0.01

-- Height at which the hand is turned, m, and how fast, rad/s.
local TURN_HEIGHT, TURN_SPEED = 0.33, 1
-- Squeeze of a rigid part: the target width is below its width by this much, m.
local SQUEEZE = 0.012

-- Moves the tool straight up to at least a height, m.
function posture.rise(arm, height)
  local at = arm.target
  arm:move_to(at:at { at.x, at.y, math.max(at.z, height) }, { speed = 0.4 })
end

-- Moves to the first pose of a list at which the arm arrives, and returns its index; nil if it arrives at none. A pose can
-- have joint angles that cannot be reached from the present ones.
function posture.first(arm, poses, options)
  local start = arm.target
  for k, pose in ipairs(poses) do
    if pcall(arm.move_to, arm, pose, options) then
      arm:wait(SETTLE)
      if arm.pose:distance(pose) < ARRIVED then return k end
    end
    pcall(arm.move_to, arm, start, options)
  end
end

-- Rises and turns the hand until it points down, closing along the y axis of the world.
function posture.down(arm)
  posture.rise(arm, TURN_HEIGHT)
  arm:move_to(softvt.pose { position = arm.target.position }, { speed = 0.4, angular_speed = TURN_SPEED })
end

-- Closes firmly on something rigid of a width (m). A tactile servo, which lifts what it grasps, is left out.
function posture.clamp(arm, width)
  local closure = math.min(1, 1 - (width - SQUEEZE) / arm.stroke)
  if arm.feels then
    arm:close_to(closure)
  else
    local _ = arm.grip_controller
    arm:grasp(closure)
  end
  arm:wait(0.2)
end

return posture
