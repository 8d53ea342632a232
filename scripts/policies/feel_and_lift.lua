-- Feels how firmly an object must be held, and lifts it. The hand moves down, closes until both gels touch, and
-- tightens while it rises. The shear of a gel that slides grows with the grip; that of an object that is held does not.
-- By then the grip is firm enough: the hand goes back down and lifts. The law that tactile-servo uses in full is in
-- scripts/softvt/servo.lua.
--
--   softvt suites/object_soft.lua --policy scripts/policies/feel_and_lift.lua --episodes 1
local MM = 1e-3 / softvt.hand().stroke -- closure per mm of width between the gels
local DOWN, LOWEST, LIFT = 10, 25, 100 -- mm per control step; height above the base, and lift, mm
local TOUCHED, COUNT = 2e-4, 8 -- divergence of the markers of a gel that is touched; readings averaged
local CLOSING, SLIDE = 0.1, 15 -- mm per control step until touch; steps of lifting, 0.1 mm each, until the gels slide
local FINEST, SHARE = 0.02, 0.02 -- tightening per control step: at least this, mm, and this share of the grip
local SEEN, FOLLOWS, LEAST = 1.3, 1.1, 0.02 -- a grip firmer by SEEN, and shear (px) greater by less than FOLLOWS: it is held
local HIGHEST = 8 -- largest height of the trial lift, mm

local hand, closure, height, place

-- Shear along the fingers of both gels, px, and the smaller divergence: that of a hard or round body pushes the markers
-- apart, that of a soft flat one draws them together.
local function read(fingers)
  local left, right = fingers.left.markers, fingers.right.markers
  return -0.5 * (left:mean()[1] + right:mean()[1]), math.min(math.abs(left:divergence()), math.abs(right:divergence()))
end

-- Moves by `closing` and `rising` mm in one control step. Returns the shear and the divergence after it.
local function move(closing, rising)
  closure = math.max(0, math.min(1, closure + closing * MM))
  height = height + rising
  return read(coroutine.yield())
end

-- Mean of `count` numbers of a list up to number `last`.
local function mean(list, last, count)
  local sum = 0
  for i = last - count + 1, last do
    sum = sum + list[i]
  end
  return sum / count
end

-- Closes until both gels touch. Returns the closure of first touch, about.
local function touch()
  local loads = {}
  for i = 1, COUNT do
    loads[i] = 0
  end
  while closure < 1 and mean(loads, #loads, COUNT) < TOUCHED do
    local _, load = move(CLOSING, 0)
    loads[#loads + 1] = load
  end
  return closure - COUNT * CLOSING * MM
end

-- Tightens and rises until the shear no longer follows the grip.
local function feel(first)
  local shears, grips, past = {}, {}, 1
  for _ = 1, SLIDE do
    move(0, 0.1)
  end
  while closure < 1 and height < LOWEST + HIGHEST do
    local closing = math.max(FINEST, SHARE * (closure - first) / MM)
    local shear = move(closing, closing)
    shears[#shears + 1], grips[#grips + 1] = shear, closure - first
    while SEEN * grips[past] < grips[#grips] do
      past = past + 1
    end
    if past > 2 * COUNT then
      local before = mean(shears, past, COUNT)
      if before > LEAST and mean(shears, #shears, COUNT) < FOLLOWS * before then return end
    end
  end
end

local function grasp()
  while height > LOWEST do
    move(0, math.max(-DOWN, LOWEST - height))
  end
  feel(touch())
  while height > LOWEST do
    move(0, math.max(-0.2, LOWEST - height))
  end
  while height < LOWEST + LIFT do
    move(0, 3)
  end
  while true do
    move(0, 0)
  end
end

return softvt.policy {
  name = "feel_and_lift",
  observes = { tactile = true },
  reset = function() hand = nil end,
  act = function(obs)
    if not hand then
      place = { obs.position[1], obs.position[2] }
      closure, height, hand = 0, 1e3 * obs.position[3], coroutine.create(grasp)
    end
    local ok, message = coroutine.resume(hand, obs.tactile)
    if not ok then error(message, 0) end
    -- The gripper points down: a rotation by 180° about x.
    return { position = { place[1], place[2], 1e-3 * height }, axis_angle = { math.pi, 0, 0 }, closure = closure }
  end,
}
