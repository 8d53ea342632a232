-- Pushes an object over its support to a place relative to another.
--
--   expert = push { object = "ramekin", target = "plate", to = "near", distance = 0.13 }
--
-- `to` is "near" or a direction as seen from the robot: "left_of", "right_of", "in_front_of" or "behind". `distance`
-- (m) is that between the centres, by default with 15 mm of space between the two. The side of the closed fingers
-- pushes from behind at `speed` (0.05 m/s), until the centre of the object is within 10 mm of the place. Friction keeps
-- the object at the fingers; one that rolls away is pushed again, up to three times.
local frames = require "experts.frames"
local grasp = require "experts.grasp"
local places = require "experts.places"
local posture = require "experts.posture"
local route = require "experts.route"

local hand = softvt.hand()
local FIELDS = { object = "string", target = "string", to = "string?", distance = "number?", speed = "number?" }
local SPEED = 0.05
-- Distance of the fingers from the object before the push, height of the sensor cases above the support, clearance to
-- leave around the hand, and accepted distance from the place, m.
local STANDOFF, UNDER, CLEARANCE, TOLERANCE = 0.02, 0.003, 0.002, 0.01
-- Distance from the place at which a push ends, m.
local ARRIVED = 0.002
-- Distance of the retreat, m, and attempts.
local RETREAT, ATTEMPTS = 0.04, 3

-- Horizontal vector from one point to another.
local function between(from, to) return { to[1] - from[1], to[2] - from[2], 0 } end

local function length(v) return math.sqrt(frames.dot(v, v)) end

-- The hand behind the object, which pushes along the horizontal unit vector `along`.
local function start_pose(object, along)
  local back = places.half_extent(object, along) + hand.case_across + STANDOFF
  local at = frames.add(object.centre, along, -back)
  at[3] = grasp.bottom(object) + hand.case_below + UNDER
  return softvt.pose { position = at, yaw = frames.half_turn_yaw(along) }
end

-- Pushes until the object is at the place, or has passed it, or no longer moves.
local function follow(arm, scene, spec, place, along)
  local first = length(between(scene:object(spec.object).centre, place))
  local steps = math.ceil(2 * (first + STANDOFF + 0.03) / (spec.speed * arm.dt))
  for _ = 1, steps do
    local centre = scene:object(spec.object).centre
    local left = between(centre, place)
    if frames.dot(left, along) <= 0 or length(left) < ARRIVED then return end
    -- The hand slows down over the last centimetre.
    local speed = spec.speed * math.min(1, 0.2 + length(left) / 0.01)
    -- The object sticks to the fingers: the hand moves as the object has to.
    arm:command(arm.target:translated(frames.scaled(frames.unit(left), speed * arm.dt)), arm.closure)
  end
end

local function attempt(arm, scene, spec, place)
  local object = scene:object(spec.object)
  local along = frames.unit(between(object.centre, place))
  local start = start_pose(object, along)
  local clearance, nearest = scene:clearance(start, { width = 0 })
  if clearance < CLEARANCE then
    arm:give_up(("%s leaves no room for the hand behind %s: %.0f mm"):format(nearest, spec.object, 1e3 * clearance))
  end
  local over = route.approach_height(scene, arm.pose.position, start, 0.08, 0.01)
  arm:move_to(arm.target:at { arm.target.x, arm.target.y, math.max(over, arm.target.z) }, { speed = 0.4 })
  arm:move_to(start:at { start.x, start.y, over }, { speed = 0.4 })
  posture.clamp(arm, 0)
  arm:move_to(start, { speed = 0.25 })
  follow(arm, scene, spec, place, along)
  arm:wait(0.2)
  arm:move_by(frames.scaled(along, -RETREAT), { speed = 0.2 })
  posture.rise(arm, math.max(over, arm.target.z + 0.1))
  arm:release { closure = 0.5, rate = 1 }
end

local function make(_, spec, surplus)
  if surplus ~= nil then error("push: expected one table", 2) end
  softvt.check_fields("push", spec, FIELDS)
  local full = {
    object = spec.object,
    target = spec.target,
    to = spec.to or "near",
    distance = spec.distance,
    speed = spec.speed or SPEED,
  }
  places.check("push", full, 3)
  if full.speed <= 0 or full.speed > 0.3 then
    error(("push: speed: expected m/s in 0..0.3, above 0, got %g"):format(full.speed), 2)
  end
  local function run(arm, scene)
    local place, problem = places.beside(scene, full)
    if not place then arm:give_up(problem) end
    local function missing() return length(between(scene:object(full.object).centre, place)) end
    for _ = 1, ATTEMPTS do
      if missing() <= TOLERANCE then return end
      attempt(arm, scene, full, place)
    end
    -- A target that is near enough need not be exact.
    if missing() > 2 * TOLERANCE then
      arm:give_up(("%s stays %.0f mm from its place after %d pushes"):format(full.object, 1e3 * missing(), ATTEMPTS))
    end
  end
  return softvt.check_names("push", run, full, { object = "object", target = "place" })
end

return setmetatable({}, { __name = "push", __call = make })
