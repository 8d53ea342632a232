-- Moves down, closes until both fingers report contact, and lifts. It uses touch alone and does not know where objects are.
-- When the object drags harder than it presses, the gripper closes slightly more.
--
--   softvt suites/object_soft.lua --policy scripts/policies/touch_and_close.lua --episodes 1
local DOWN, UP = 0.01, 0.005       -- m per control step
local LOWEST, LIFT = 0.025, 0.10   -- height above the base, and lift, m
local HELD, STEP = 0.08, 0.0125    -- px of marker motion; closure per control step

local phase, start, height, closure

-- The smaller value of a measure over both fingers.
local function least(touch, measure)
  return math.min(measure(touch.left.markers), measure(touch.right.markers))
end

local phases = {}

function phases.down()
  height = math.max(LOWEST, height - DOWN)
  if height == LOWEST then phase = "close" end
end

function phases.close(touch)
  if closure == 1 or least(touch, function(m) return m:press() end) > HELD then
    phase = "lift"
  else
    closure = math.min(1, closure + STEP)
  end
end

function phases.lift(touch)
  height = math.min(LOWEST + LIFT, height + UP)
  if least(touch, function(m) return m:press() - m:drag() end) < 0 then closure = math.min(1, closure + STEP) end
end

return softvt.policy {
  name = "touch_and_close",
  observes = { touch = true },
  reset = function() phase, start, closure = "down", nil, 0 end,
  act = function(obs)
    if not start then
      start = { obs.position[1], obs.position[2] }
      height = obs.position[3]
    end
    phases[phase](obs.touch)
    -- The gripper points down: a rotation by 180° about x.
    return { position = { start[1], start[2], height }, axis_angle = { math.pi, 0, 0 }, closure = closure }
  end,
}
