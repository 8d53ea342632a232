-- Opens a drawer by its handle, or pushes it closed.
--
--   expert = drawer { joint = "cabinet.top_drawer", share = 0.8 }
--   expert = drawer { joint = "cabinet.top_drawer", close = true }
--
-- The fingers grasp the bar of the handle from in front, one above and one below it, and pull along the joint until it
-- is open by `share` (0.85) of its range. `close` pushes the handle with the side of the closed fingers until at most
-- `share` (0.02) is open. `speed` (0.1 m/s) is that of the drawer. The part's hints `handle_height_m`, above the
-- object's lowest point, and `handle_width_m`, the thickness of the bar, describe the handle; it is in the middle of
-- the front and stands out most.
local frames = require "experts.frames"
local grasp = require "experts.grasp"
local mechanism = require "experts.mechanism"
local places = require "experts.places"
local posture = require "experts.posture"

local FIELDS = { joint = "string", share = "number?", close = "boolean?", speed = "number?" }
local OPEN_SHARE, CLOSED_SHARE, SPEED = 0.85, 0.02, 0.1
-- Distance of the tool from the bar when the fingers grasp it, so that their tips stay clear of the front; distance in
-- front of it from which they approach; height above it at which the hand is turned, m.
local TIP, APPROACH, ABOVE = 0.005, 0.09, 0.16
-- Free space on each side of the bar during the approach, and clearance to leave around the hand, m.
local BAR_CLEARANCE, CLEARANCE = 0.012, 0.001
-- Half thickness of a finger along the hand's x axis, m, and how far a push goes beyond the end of the joint, m.
local FINGER, OVERSHOOT = 0.014, 0.003
-- Sliding of the bar between the gels while it is pulled, m.
local SLIP = 0.003
-- Accepted error of the joint, as a share of its range, and attempts.
local TOLERANCE, ATTEMPTS = 0.03, 3

local UP = { 0, 0, 1 }

-- Centre of the bar, direction out of the drawer, and half of the bar's thickness, m.
local function handle(arm, scene, spec)
  local object, part = mechanism.find(arm, scene, spec.joint)
  local out = mechanism.axis(object, part)
  local height, width = part.hints.handle_height_m, part.hints.handle_width_m
  if not (height and width) then arm:give_up(spec.joint .. " has no hints handle_height_m and handle_width_m") end
  local front = frames.add(part.centre, out, places.half_extent(part, out) - width / 2)
  return { front[1], front[2], grasp.bottom(object) + height }, out, width / 2, part
end

-- Hands in front of the bar, closing across it.
local function hands(bar, out)
  local list = {}
  for _, sign in ipairs { 1, -1 } do
    list[#list + 1] = function(distance, height)
      local at = frames.add(frames.add(bar, out, distance), UP, height or 0)
      return frames.hand(at, frames.scaled(out, -1), { 0, 0, sign })
    end
  end
  return list
end

-- Grasps the bar. Returns nil and the reason if it cannot.
local function hold(arm, scene, spec)
  local bar, out, radius = handle(arm, scene, spec)
  local opening = 2 * (radius + BAR_CLEARANCE)
  local paths = {}
  for _, hand in ipairs(hands(bar, out)) do
    local clearance = scene:clearance(hand(TIP), { width = opening })
    if clearance < CLEARANCE then
      return nil, ("leaves the hand in front of its handle %.0f mm of clearance"):format(1e3 * clearance)
    end
    paths[#paths + 1] = { hand(APPROACH, ABOVE), hand(APPROACH), hand(TIP) }
  end
  posture.rise(arm, bar[3] + ABOVE)
  if not posture.first(arm, paths, { speed = 0.4, angular_speed = 1, closure = 1 - opening / arm.stroke }) then
    return nil, "is out of reach of a hand in front of it"
  end
  posture.clamp(arm, 2 * radius)
  return true
end

local function let_go(arm, out)
  arm:open { rate = 1 }
  arm:move_by(frames.scaled(out, APPROACH), { speed = 0.3 })
end

local function open(arm, scene, spec)
  local reason
  for _ = 1, ATTEMPTS do
    local _, out, _, part = handle(arm, scene, spec)
    local goal = mechanism.value(part, spec.share)
    if part.joint >= mechanism.value(part, spec.share - TOLERANCE) then return end
    local held
    held, reason = hold(arm, scene, spec)
    if not held then arm:give_up(("%s %s"):format(spec.joint, reason)) end
    -- The handle slips a little between the gels.
    arm:move_by(frames.scaled(out, goal - part.joint + SLIP), { speed = spec.speed })
    arm:wait(0.2)
    let_go(arm, out)
  end
end

local function close(arm, scene, spec)
  for _ = 1, ATTEMPTS do
    local bar, out, radius, part = handle(arm, scene, spec)
    local goal = mechanism.value(part, spec.share)
    if part.joint <= goal then return end
    local outside = radius + FINGER
    local turned = softvt.pose { position = bar, yaw = frames.half_turn_yaw(out) }
    local start = turned:translated(frames.scaled(out, outside + 0.03))
    posture.rise(arm, bar[3] + ABOVE)
    arm:move_to(start:translated(frames.scaled(UP, ABOVE)), { speed = 0.4, closure = 1 })
    arm:move_to(start, { speed = 0.25 })
    local travel = part.joint - mechanism.range(part)[1] + OVERSHOOT
    arm:move_to(turned:translated(frames.scaled(out, outside - travel)), { speed = spec.speed })
    arm:wait(0.2)
    arm:move_by(frames.scaled(out, 0.03), { speed = 0.25 })
    arm:move_by(frames.scaled(UP, ABOVE), { speed = 0.4 })
  end
end

return function(spec)
  softvt.check_fields("drawer", spec, FIELDS)
  local full = {
    joint = spec.joint,
    share = spec.share or (spec.close and CLOSED_SHARE or OPEN_SHARE),
    speed = spec.speed or SPEED,
  }
  if full.share < 0 or full.share > 1 then
    error(("drawer: share: expected a share in 0..1, got %g"):format(full.share), 2)
  end
  return function(arm, scene)
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
end
