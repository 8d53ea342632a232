-- Moves down, closes until both fingers report contact, and lifts. It uses the tactile sensors alone.
-- When the outward shear exceeds the residual, the gripper closes slightly more.
--
--   softvt suites/object_soft.lua --policy scripts/policies/touch_and_close.lua --episodes 1
local DOWN, UP = 0.01, 0.005 -- m per control step
local LOWEST, LIFT = 0.025, 0.10 -- height above the base, and lift, m
local HELD, STEP = 0.08, 0.0125 -- px of marker motion; closure per control step

local phase, start, height, closure

-- The smaller value of a measure over both fingers.
local function least(fingers, measure) return math.min(measure(fingers.left.markers), measure(fingers.right.markers)) end

local phases = {}

function phases.down()
  height = math.max(LOWEST, height - DOWN)
  if height == LOWEST then phase = "close" end
end

function phases.close(fingers)
  if closure == 1 or least(fingers, function(m) return m:rms_residual() end) > HELD then
    phase = "lift"
  else
    closure = math.min(1, closure + STEP)
  end
end

function phases.lift(fingers)
  height = math.min(LOWEST + LIFT, height + UP)
  if least(fingers, function(m) return m:rms_residual() - m:outward_shear() end) < 0 then
    closure = math.min(1, closure + STEP)
  end
end

return softvt.policy {
  name = "touch_and_close",
  observes = { tactile = true },
  reset = function()
    phase, start, closure = "down", nil, 0
  end,
  act = function(obs)
    if not start then
      start = { obs.position[1], obs.position[2] }
      height = obs.position[3]
    end
    phases[phase](obs.tactile)
    -- The gripper points down: a rotation by 180° about x.
    return { position = { start[1], start[2], height }, axis_angle = { math.pi, 0, 0 }, closure = closure }
  end,
}
