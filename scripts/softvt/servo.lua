-- A tactile servo: closes until the markers of both fingers say that something is held, and no further; closes a little
-- more whenever what is held drags on the gels harder than it presses into them. It knows gels and nothing of objects: no
-- closure, stiffness, mass or friction. The same numbers hold for a bun and for a can.
local servo = {}

local min = math.min

-- Press at which a finger holds something, and at which it touches something, px of marker motion. Flat dough presses by
-- 0.08 px at 0.6 N, round dough at 0.3 N, a carton at 0.3 N.
local HELD, TOUCHED = 0.08, 0.01
-- Steps of closure a control step: from the first touch on, and in answer to a drag (0.5 mm and 1 mm of width).
local FINE, ANSWER = 0.00625, 0.0125
-- What is held must press at least this much harder than it drags. A grasp that slides drags three times as hard as it
-- presses or harder, where friction is that of a gel.
local RATIO = 1

local function least(fingers, measure) return min(measure(fingers.left.markers), measure(fingers.right.markers)) end

local function press(markers) return markers:press() end

-- Whether something touches either finger.
local function touched(fingers) return fingers.left.markers:press() > TOUCHED or fingers.right.markers:press() > TOUCHED end

-- Press that is left over, px; negative in a finger that something is dragged out of.
local function spare(markers) return markers:press() - RATIO * markers:drag() end

-- Closes at a rate (1/s) until both fingers hold something, or the gripper is shut. `step` sends a closure and comes back
-- with what the fingers feel then.
function servo.close(closure, rate, step)
  local fingers = step(closure)
  while closure < 1 and least(fingers, press) < HELD do
    closure = min(1, closure + (touched(fingers) and FINE or rate))
    fingers = step(closure)
  end
  return closure
end

-- The closure that goes on holding what the fingers feel.
function servo.keep(closure, fingers)
  if least(fingers, spare) >= 0 then return closure end
  return min(1, closure + ANSWER)
end

return servo
