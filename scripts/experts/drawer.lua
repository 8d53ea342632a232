-- Opens a drawer by its handle, or pushes it closed.
--
--   expert = drawer { joint = "cabinet.top_drawer", share = 0.8 }
--   expert = drawer { joint = "cabinet.top_drawer", close = true }
--
-- The fingers grasp the bar of the handle from in front, one above and one below it, and pull along the joint until it
-- is open by `share` (0.85) of its range. `close` pushes the handle with the tips of the closed fingers until at most
-- `share` (0.02) is open. `speed` (0.1 m/s) is that of the drawer. The part's hints `handle_height_m`, above the
-- object's lowest point, and `handle_width_m`, the thickness of the bar, describe the handle; it is in the middle of
-- the front and stands out most.
local frames = require "experts.frames"
local grasp = require "experts.grasp"
local mechanism = require "experts.mechanism"
local places = require "experts.places"
local posture = require "experts.posture"

local hand = softvt.hand()
local FIELDS = { joint = "string", share = "number?", close = "boolean?", speed = "number?" }
local OPEN_SHARE, CLOSED_SHARE, SPEED = 0.85, 0.02, 0.1
-- Distance of the tool from the bar when the fingers grasp it, so that their tips stay clear of the front; distance in
-- front of it from which they approach; height above it at which the hand is turned, m.
local TIP, APPROACH, ABOVE = 0.005, 0.09, 0.16
-- Free space on each side of the bar during the approach, and clearance to leave around the hand, m.
local BAR_CLEARANCE, CLEARANCE = 0.012, 0.001
-- Rotations of the hand about its fingers to try, rad.
local ROLLS = { 0, math.rad(25), math.rad(-25), math.rad(45), math.rad(-45) }
-- Angle of the fingers below the horizontal in a push, rad.
local PUSH_TILT = math.rad(60)
-- Place of the leading edge of the tips in a push, from the tool towards the drawer and downwards, m.
local EDGE_OUT = hand.case_below * math.cos(PUSH_TILT) + hand.case_across * math.sin(PUSH_TILT)
local EDGE_DOWN = hand.case_below * math.sin(PUSH_TILT) - hand.case_across * math.cos(PUSH_TILT)
-- Distance from the bar before a push, and how far the push goes beyond the end, m.
local STANDOFF, OVERSHOOT = 0.03, 0.003
-- Sliding of the bar between the gels while it is pulled, m.
local SLIP = 0.003
-- Accepted error of the joint, as a share of its range, and attempts.
local TOLERANCE, ATTEMPTS = 0.03, 3

local UP = { 0, 0, 1 }

-- Centre of the bar, direction out of the drawer, and half of the bar's thickness, m.
local function handle(arm, scene, spec)
  local object, part = mechanism.find(arm, scene, spec.joint)
  local out = part.joint_axis
  if math.abs(out[3]) > 0.1 then arm:give_up(spec.joint .. " does not slide horizontally") end
  local height, width = part.hints.handle_height_m, part.hints.handle_width_m
  if not (height and width) then arm:give_up(spec.joint .. " has no hints handle_height_m and handle_width_m") end
  local front = frames.add(part.centre, out, places.half_extent(part, out) - width / 2)
  return { front[1], front[2], grasp.bottom(object) + height }, out, width / 2, part
end

-- Hands in front of the bar: { at, width, opening }. `at` gives the pose by the distance from the bar and the height
-- above it, `width` is that of what is between the fingers, and `opening` passes over it, m. The hand closes across the
-- bar, or is rolled about its fingers where the palm would touch something. The bar is then aslant, and the edges of
-- the cases hold it instead of the gels.
local function hands(bar, out, radius)
  local list, forward = {}, frames.scaled(out, -1)
  for _, roll in ipairs(ROLLS) do
    for _, sign in ipairs { 1, -1 } do
      local closing = frames.rotated({ 0, 0, sign }, forward, roll)
      local width = 2 * (radius / math.cos(roll) + hand.case_across * math.abs(math.tan(roll)))
      local function at(distance, height)
        return frames.hand(frames.add(frames.add(bar, out, distance), UP, height or 0), forward, closing)
      end
      list[#list + 1] = { at = at, width = width, opening = math.min(hand.stroke, width + 2 * BAR_CLEARANCE) }
    end
  end
  return list
end

-- Opens the hand to a width, m, and returns the measured one: a binary gripper opens all the way.
local function open_to(arm, width)
  arm:close_to(1 - width / arm.stroke, { rate = 1 })
  arm:wait(0.2)
  return math.min(arm.stroke, arm.width)
end

-- Grasps the bar. Returns the width between the fingers on the way to it, m; nil and the reason if it cannot.
local function hold(arm, scene, spec)
  local bar, out, radius = handle(arm, scene, spec)
  local list, paths, chosen, most = hands(bar, out, radius), {}, {}, -math.huge
  posture.rise(arm, bar[3] + ABOVE)
  local opened = open_to(arm, list[1].opening)
  local is_binary = opened > list[1].opening + BAR_CLEARANCE
  for _, held in ipairs(list) do
    local clearance = scene:clearance(held.at(TIP), { width = is_binary and opened or held.opening })
    most = math.max(most, clearance)
    -- All need the same opening.
    if clearance >= CLEARANCE and held.opening == (chosen[1] or held).opening then
      chosen[#chosen + 1] = held
      paths[#paths + 1] = { held.at(APPROACH, ABOVE), held.at(APPROACH), held.at(TIP) }
    end
  end
  if #paths == 0 then return nil, ("leaves the hand in front of its handle %.0f mm of clearance"):format(1e3 * most) end
  open_to(arm, chosen[1].opening)
  local k = posture.first(arm, paths, { speed = 0.4, angular_speed = 1 })
  if not k then return nil, "is out of reach of a hand in front of it" end
  posture.clamp(arm, chosen[k].width)
  return chosen[k].opening
end

local function open(arm, scene, spec)
  for _ = 1, ATTEMPTS do
    local _, out, _, part = handle(arm, scene, spec)
    if part.joint >= mechanism.value(part, spec.share - TOLERANCE) then return end
    local opening, reason = hold(arm, scene, spec)
    if not opening then arm:give_up(("%s %s"):format(spec.joint, reason)) end
    -- The handle slips a little between the gels.
    arm:move_by(frames.scaled(out, mechanism.value(part, spec.share) - part.joint + SLIP), { speed = spec.speed })
    arm:wait(0.2)
    arm:release { closure = 1 - opening / arm.stroke, rate = 1 }
    arm:wait(0.1)
    arm:move_by(frames.scaled(out, APPROACH), { speed = 0.3 })
  end
end

local function close(arm, scene, spec)
  for _ = 1, ATTEMPTS do
    local bar, out, radius, part = handle(arm, scene, spec)
    local missing = part.joint - mechanism.value(part, spec.share)
    if missing <= 0 then return end
    -- The fingers point at the handle from above and in front, so that the palm stays clear of the handles above it.
    local forward = frames.add(frames.scaled(out, -math.cos(PUSH_TILT)), UP, -math.sin(PUSH_TILT))
    local paths = {}
    for k, sign in ipairs { 1, -1 } do
      local at = frames.add(frames.add(bar, out, radius + EDGE_OUT + STANDOFF), UP, EDGE_DOWN)
      local start = frames.hand(at, forward, { -sign * out[2], sign * out[1], 0 })
      paths[k] = { start:translated { 0, 0, APPROACH }, start }
    end
    posture.rise(arm, bar[3] + ABOVE)
    posture.clamp(arm, 0)
    if not posture.first(arm, paths, { speed = 0.4, angular_speed = 1 }) then
      arm:give_up(spec.joint .. " is out of reach of a hand in front of it")
    end
    arm:move_by(frames.scaled(out, -STANDOFF - missing - OVERSHOOT), { speed = spec.speed })
    arm:wait(0.2)
    arm:move_by(frames.scaled(out, STANDOFF), { speed = 0.25 })
    arm:release { closure = 0.5, rate = 1 }
  end
end

local function make(_, spec, surplus)
  if surplus ~= nil then error("drawer: expected one table", 2) end
  softvt.check_fields("drawer", spec, FIELDS)
  local full = {
    joint = spec.joint,
    share = spec.share or (spec.close and CLOSED_SHARE or OPEN_SHARE),
    speed = spec.speed or SPEED,
  }
  if full.share < 0 or full.share > 1 then
    error(("drawer: share: expected a share in 0..1, got %g"):format(full.share), 2)
  end
  if full.speed <= 0 or full.speed > 0.3 then
    error(("drawer: speed: expected m/s in 0..0.3, above 0, got %g"):format(full.speed), 2)
  end
  local function run(arm, scene)
    local home = arm.target.position
    local move = spec.close and close or open
    move(arm, scene, full)
    posture.down(arm, home)
    local _, part = mechanism.find(arm, scene, full.joint)
    local limit = mechanism.value(part, full.share + (spec.close and TOLERANCE or -TOLERANCE))
    if (spec.close and part.joint > limit) or (not spec.close and part.joint < limit) then
      arm:give_up(("%s ends at %.3f after %d attempts"):format(full.joint, part.joint, ATTEMPTS))
    end
  end
  return softvt.check_names("drawer", run, full, { joint = "joint" })
end

return setmetatable({}, { __name = "drawer", __call = make })
