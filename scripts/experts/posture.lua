-- Changes between a hand that points down and a hand in another orientation.
local grasp = require "experts.grasp"

local posture = {}

-- Time after which the arm has arrived, s, and the largest distance from a pose where it has, m.
local SETTLE, ARRIVED = 0.2, 0.01
-- Height at which the hand is turned, m, and how fast, rad/s.
local TURN_HEIGHT, TURN_SPEED = 0.33, 1
-- Motion close to an object.
local NEAR = { speed = 0.2, angular_speed = TURN_SPEED }

-- Moves the tool straight up to at least a height, m.
function posture.rise(arm, height)
  local at = arm.target
  arm:move_to(at:at { at.x, at.y, math.max(at.z, height) }, { speed = 0.4 })
end

-- Moves to a pose. Returns whether the arm has arrived: a pose can be out of reach, or have joint angles that cannot be
-- reached from the present ones.
local function arrives(arm, pose, options)
  if not pcall(arm.move_to, arm, pose, options) then return false end
  arm:wait(SETTLE)
  return arm.pose:distance(pose) < ARRIVED
end

-- Moves along the first of several paths, lists of poses, on which the arm arrives everywhere, and returns its index.
-- It returns to the start from the others. Returns nil if no path is reached. `options` are those of the motion to the
-- first pose.
function posture.first(arm, paths, options)
  local start = arm.target
  for k, path in ipairs(paths) do
    local reached = 0
    while reached < #path and arrives(arm, path[reached + 1], reached == 0 and options or NEAR) do
      reached = reached + 1
    end
    if reached == #path then return k end
    for back = reached, 1, -1 do
      pcall(arm.move_to, arm, path[back], NEAR)
    end
    pcall(arm.move_to, arm, start, options)
  end
end

-- Rises and turns the hand until it points down, closing along the y axis of the world: where it is, or on the way to
-- the point `home`, where it has been before.
function posture.down(arm, home)
  posture.rise(arm, TURN_HEIGHT)
  local from, paths = arm.target, {}
  for k = 0, 3 do
    local x, y = from.x + k / 3 * (home[1] - from.x), from.y + k / 3 * (home[2] - from.y)
    paths[#paths + 1] = { softvt.pose { position = { x, y, from.z } } }
  end
  if not posture.first(arm, paths, { speed = 0.4, angular_speed = TURN_SPEED }) then
    arm:give_up "the hand cannot be turned down again"
  end
end

-- Closes firmly on something rigid of a width (m), or the empty hand for a width of 0. A tactile servo lifts what it
-- grasps, so the hand then closes without it.
function posture.clamp(arm, width)
  local closure, rate = math.min(1, 1 - (width - grasp.SQUEEZE) / arm.stroke), { rate = width > 0 and 0.5 or 1 }
  if arm.feels then
    arm:close_to(closure, rate)
  else
    -- A controller of the grip is for what is carried: reading its name tells that this grasp is not meant for it.
    local _ = arm.grip_controller
    arm:grasp(closure, rate)
  end
  arm:wait(0.2)
end

return posture
