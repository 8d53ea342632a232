-- A tactile servo. It closes until the markers of both fingers show a firm grasp, and closes slightly more whenever the outward
-- shear of the markers exceeds their residual. Its parameters describe the gels only, not the object's closure,
-- stiffness, mass or friction, and are the same for a bun and a can.
local servo = {}

local min = math.min

-- Residual of the markers in a firm grasp and at first contact, px. Flat dough gives 0.08 px at 0.6 N, round dough and a carton
-- at 0.3 N.
local HELD, TOUCHED = 0.08, 0.01
-- Change of closure per control step after first contact, and in response to shear (0.16 mm and 0.5 mm of width).
local FINE, TIGHTEN = 0.002, 0.00625
-- Factor on HELD per grasp that has failed, and how many count: the edge of a hard object shows much residual at little force.
local FIRMER, MOST_FAILURES = 3, 2
-- Smallest ratio of residual to outward shear of a held object. In a sliding grasp the shear is at least three times the
-- residual at the friction of a gel.
local RATIO = 0.5

local function least(fingers, measure) return min(measure(fingers.left.markers), measure(fingers.right.markers)) end

local function residual(markers) return markers:rms_residual() end

-- True if an object touches either finger.
local function touched(fingers) return fingers.left.markers:rms_residual() > TOUCHED or fingers.right.markers:rms_residual() > TOUCHED end

-- Residual in excess of the outward shear, px. Negative if the object is being pulled out of the finger.
local function margin(markers) return markers:rms_residual() - RATIO * markers:outward_shear() end

-- Closes by `rate` per control step until both fingers show a firm grasp or the gripper is closed. `step` sends a closure and returns the
-- finger readings of the next control step; `failures` counts the grasps that have failed here.
function servo.close(closure, rate, failures, step)
  local held, fingers = HELD * FIRMER ^ min(failures, MOST_FAILURES), step(closure)
  while closure < 1 and least(fingers, residual) < held do
    closure = min(1, closure + (touched(fingers) and FINE or rate))
    fingers = step(closure)
  end
  return closure
end

-- Returns the closure that keeps the grasp, given the finger readings.
function servo.keep(closure, fingers)
  if least(fingers, margin) >= 0 then return closure end
  return min(1, closure + TIGHTEN)
end

return servo
