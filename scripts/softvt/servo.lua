-- A tactile servo: a hand that feels how firmly it must hold. It closes until both gels touch, lifts until the gels
-- slide along the object, and tightens while it lifts. The shear of a sliding gel grows with the force; that of a held
-- object is its weight. Once the shear stops growing, the grip is the least one that holds, if the hand can go down a
-- little and the object stays with it. The hand tightens beyond that grip by a margin, goes back down, closes to it,
-- and keeps it. Its readings are the markers and its own closure. Its parameters describe gels and markers only, not
-- the object.
local servo, stroke = {}, ...

local max, min, ceil = math.max, math.min, math.ceil

-- Change of closure per mm of width between the gels.
local MM = 1e-3 / stroke

-- Noise of the mean motion along x of the markers of both fingers, px: 0.1 px per marker.
local NOISE = 0.007
-- Divergence of the markers of a gel that is touched (about 0.08 N), and control steps over which it is averaged.
local TOUCHED, WINDOW = 4e-4, 5
-- Closing until both gels touch, mm per control step, and after FAR mm without a touch. The hand then opens by BACK mm,
-- since a touch is noticed late; the gels began to touch about LATE mm before.
local APPROACH, FAR_APPROACH, FAR, BACK, LATE = 0.1, 0.4, 15, 0.25, 0.5
-- Lifting until the gels slide, mm per control step, the growth of the shear over 4 steps that tells that they stick,
-- px, and the largest height, mm.
local LIFT, STICKS, LIFT_MOST = 0.1, 0.015, 3
-- Tightening: share of the closure since touch per control step, from small to large shears; shear that counts as
-- large, px; and the smallest change, mm.
local SLOW, FAST, STRONG, FINEST = 0.015, 0.025, 0.15, 0.02
-- Stiffness of a light contact in shear, px per mm, the factor by which lifting exceeds what sliding needs, bounds of
-- lifting over closing, and the largest height of the trial lift, mm.
local STIFFNESS, SURE, LEAST_RISE, MOST_RISE, HIGHEST = 0.35, 2, 0.4, 1.5, 12
-- The shear has stopped growing if a line with a bend fits better by this many variances of the noise, the force has
-- since grown by SEEN, and the shear at the bend is at least LEAST px. CONFIRM readings must confirm it.
local EVIDENCE, SEEN, LEAST, CONFIRM = 14, 1.2, 0.03, 12
-- Test of a bend: the hand goes up and down by TRIAL mm. The shear of a held object is its weight and stays above the
-- share HELD of that at the bend; gels that slide lose it on the way down.
local TRIAL, HELD = 1, 0.6
-- Force of the grip over the least one that holds, and the factor per grasp that has failed here, of which
-- MOST_FAILURES count.
local MARGIN, FIRMER, MOST_FAILURES = 1.25, 1.15, 2
-- Going down: distance below where the object was lifted, mm; share of the grip from there on, mm per control step; and
-- closing to the grip, mm per control step.
local LANDING, LOOSENED, DOWN, CLOSING = 0.3, 0.3, 0.2, 0.15

-- Mean motion of the markers of both fingers towards the fingertips, px, and the divergence of each.
local function read(fingers)
  local left, right = fingers.left.markers, fingers.right.markers
  return -0.5 * (left:mean()[1] + right:mean()[1]), left:divergence(), right:divergence()
end

-- Mean of the last `count` numbers of a list.
local function recent(list, count)
  local sum, first = 0, max(1, #list - count + 1)
  for i = first, #list do
    sum = sum + list[i]
  end
  return sum / (#list - first + 1)
end

-- Load of a gel by its last divergences. A hard or round body pushes the markers apart, a soft flat one draws them
-- together.
local function load_of(divergences) return math.abs(recent(divergences, WINDOW)) end

local Trial = {}
Trial.__index = Trial

-- Closes by `closing` mm, rises by `rising` mm and shifts the hand by `shifting` mm towards the left finger, in one
-- control step.
function Trial:move(closing, rising, shifting)
  self.closure = max(0, min(1, self.closure + closing * MM))
  self.height, self.shift = self.height + rising, self.shift + shifting
  local n = #self.shear + 1
  self.shear[n], self.left[n], self.right[n] = read(self.step(self.closure, 1e-3 * self.height, 1e-3 * self.shift))
  self.closures[n], self.heights[n] = self.closure, self.height
end

-- Closes until both gels touch. The hand follows the gel that touches first, so that it does not push the object.
function Trial:approach()
  local start, left, right = self.closure, false, false
  while self.closure < 1 and not (left and right) do
    local shifting = left == right and 0 or 0.5 * APPROACH * (left and 1 or -1)
    local is_far = self.closure - start > FAR * MM and not (left or right)
    self:move(is_far and FAR_APPROACH or APPROACH, 0, shifting)
    left, right = load_of(self.left) > TOUCHED, load_of(self.right) > TOUCHED
  end
  self.touch = self.closure - LATE * MM
  for _ = 1, 4 do
    self:move(-BACK / 4, 0, 0)
  end
end

-- Lifts until the gels slide along the object or carry it.
function Trial:slide()
  local count, before = 0, 0
  repeat
    if count % 4 == 0 then before = recent(self.shear, 4) end
    self:move(0, LIFT, 0)
    count = count + 1
  until self.height > LIFT_MOST or (count >= 8 and count % 4 == 0 and recent(self.shear, 4) - before < STICKS)
end

-- Where the shear has stopped growing since reading `first`: { closure, height, slope, shear }; nil if it still grows.
-- Fits shear = p + b min(0, closure - bend) by least squares, for a bend at each reading; touch counts as a reading
-- without shear.
function Trial:bend(first)
  local shear, closures, last, best, line = self.shear, self.closures, #self.shear, nil, nil
  for k = first, last do
    local bend = closures[k]
    local x0 = min(0, self.touch - bend)
    local n, sx, sxx, sy, sxy, syy = 1, x0, x0 * x0, 0, 0, 0
    for i = first, last do
      local x, y = min(0, closures[i] - bend), shear[i]
      n, sx, sxx, sy, sxy, syy = n + 1, sx + x, sxx + x * x, sy + y, sxy + x * y, syy + y * y
    end
    local b = (n * sxy - sx * sy) / (n * sxx - sx * sx)
    local p = (sy - b * sx) / n
    line = { closure = bend, height = self.heights[k], slope = b, shear = p, error = syy - p * sy - b * sxy }
    if not best or line.error < best.error then best = line end
  end
  local missing = best and best.slope * (self.closure - best.closure) or 0
  if
    missing > 0
    and best.shear > LEAST
    and missing > (SEEN - 1) * best.shear
    and line.error - best.error > EVIDENCE * NOISE ^ 2
  then
    return best
  end
end

-- Goes up and down to test whether the object is held, for a bend of the shear; stays up if it is not.
function Trial:test_hold(bend)
  local count = ceil(TRIAL / LIFT)
  for _ = 1, count do
    self:move(0, LIFT, 0)
  end
  for _ = 1, count do
    self:move(0, -LIFT, 0)
  end
  if recent(self.shear, 3) > HELD * bend.shear then return true end
  for _ = 1, count do
    self:move(0, LIFT, 0)
  end
  return false
end

-- Tightens and lifts until the shear stops growing. Returns the least grip that holds as Trial:bend does, or nil.
function Trial:tighten(margin)
  local first = #self.shear + 3
  while self.closure < 1 and self.height < HIGHEST do
    local shear, grip = max(0, recent(self.shear, WINDOW)), (self.closure - self.touch) / MM
    local closing = max(FINEST, max(SLOW, min(FAST, FAST * shear / STRONG)) * grip)
    local rising = max(LEAST_RISE, min(MOST_RISE, SURE * shear / grip / STIFFNESS)) * closing
    local left, right = load_of(self.left), load_of(self.right)
    self:move(closing, rising, 0.5 * closing * max(-1, min(1, (left - right) / max(TOUCHED, left + right))))
    local found = self:bend(first)
    if found then
      local wanted = self.touch + margin * (found.closure - self.touch)
      for _ = 1, CONFIRM do
        self:move(max(0, min(closing, (wanted - self.closure) / MM)), 0.03, 0)
      end
      found = self:bend(first)
      if found and self:test_hold(found) then return found end
      if found then first = #self.shear + 3 end
    end
  end
end

-- Puts the object down from above `height` (mm), goes back down with a loosened grip, and closes to the grip.
function Trial:settle(grip, height)
  local loosened, low = self.touch + LOOSENED * (grip - self.touch), max(0, height - LANDING)
  for k = ceil((self.height - low) / DOWN), 1, -1 do
    self:move(0, (low - self.height) / k, 0)
  end
  for k = 5, 1, -1 do
    self:move((loosened - self.closure) / MM / k, 0, 0)
  end
  for k = ceil(self.height / DOWN), 1, -1 do
    self:move(0, -self.height / k, 0)
  end
  for k = max(5, ceil((grip - self.closure) / MM / CLOSING)), 1, -1 do
    self:move((grip - self.closure) / MM / k, 0, 0)
  end
end

-- Grasps what is between the fingers. `closure` is where they are, and `failures` counts the grasps that have failed
-- here. `step` sends a closure with a height and a shift of the hand towards its left finger, m, and returns the finger
-- readings of the next control step. Returns the closure of the grip.
function servo.grasp(closure, failures, step)
  local trial = setmetatable({
    step = step,
    closure = closure,
    height = 0,
    shift = 0,
    shear = {},
    left = {},
    right = {},
    closures = {},
    heights = {},
  }, Trial)
  local margin = MARGIN * FIRMER ^ min(failures, MOST_FAILURES)
  trial:approach()
  trial:slide()
  local least = trial:tighten(margin)
  local grip = least and min(1, least.closure + (margin - 1) * least.shear / least.slope) or trial.closure
  trial:settle(grip, least and least.height or trial.height)
  return grip
end

return servo
