-- Turns a knob with a horizontal axis to an angle.
--
--   expert = knob { joint = "stove.knob", angle = 0.6 }
--
-- The fingers grasp the grip of the knob from above and in front, across its faces or its ends, and turn it about its
-- axis as far as the hand keeps clear of the table and of other objects. They then grasp it again until the joint is at
-- `angle` (rad, to 0.06). Close to a table a grasp turns by about 40° to either side of upright, and none may lead
-- further. `speed` (0.6 rad/s) is that of the knob. The part's hints `grip_width_m`, `grip_length_m` and `grip_depth_m`
-- are the sizes of the grip across, along and in front of the knob; at a joint of 0 it is upright.
local frames = require "experts.frames"
local mechanism = require "experts.mechanism"
local places = require "experts.places"
local posture = require "experts.posture"

local FIELDS = { joint = "string", angle = "number", speed = "number?" }
local SPEED, TOLERANCE, STROKES = 0.6, 0.06, 8
-- Angles of the hand below the horizontal to try, rad. Below 75° the palm stays in front of the object.
local TILTS = { math.rad(70), math.rad(60), math.rad(50), math.rad(75) }
-- Distances of the tool from the middle of the grip, back along the fingers and out along the axis, to try, m.
local BACK, OUT = { 0.026, 0.022, 0.018, 0.010, 0.003 }, { 0, 0.003, 0.006, 0.009, 0.012 }
-- Free space on each side of the grip during the approach, clearance to leave around the hand, and distance from which
-- the fingers approach, m.
local GRIP_CLEARANCE, CLEARANCE, APPROACH = 0.004, 0.001, 0.08
-- Step of the turn whose clearance is checked, the least and the largest turn of a stroke, rad.
local CHECK_STEP, LEAST_STROKE, LARGEST_STROKE = math.rad(5), math.rad(8), math.rad(90)
-- Distance of the hand behind its command at which a turn ends, m and rad.
local MOST_LAG = { 0.02, 0.3 }
-- Number of grips whose reach is tried.
local MOST_GRIPS = 4

local UP = { 0, 0, 1 }

-- Minimum-jerk time scaling on [0, 1], and its largest slope.
local function smooth(u) return u * u * u * (10 + u * (6 * u - 15)) end
local PEAK = 1.875

-- The knob: its part, axis, middle of the grip, and sizes of the grip.
local function knob_of(arm, scene, joint)
  local object, part = mechanism.find(arm, scene, joint)
  local axis, origin, hints = part.joint_axis, part.joint_origin, part.hints
  if not (hints.grip_width_m and hints.grip_length_m and hints.grip_depth_m) then
    arm:give_up(joint .. " has no hints grip_width_m, grip_length_m and grip_depth_m")
  end
  if math.abs(axis[3]) > 0.1 then arm:give_up(joint .. " has an axis that is not horizontal") end
  local front = frames.dot(frames.add(part.centre, origin, -1), axis) + places.half_extent(part, axis)
  local middle = frames.add(origin, axis, front - hints.grip_depth_m / 2)
  return { object = object, part = part, axis = axis, middle = middle }
end

-- The closure at which the fingers are clear of a grip.
local function clear_closure(arm, grip) return math.max(0, 1 - (grip.width + 2 * GRIP_CLEARANCE) / arm.stroke) end

-- A hand at the grip, turned about the axis by `angle` from where it closes horizontally.
local function hand(knob, grip, angle, away)
  local forward = frames.add(frames.scaled(knob.axis, -math.cos(grip.tilt)), UP, -math.sin(grip.tilt))
  local across = frames.scaled(frames.cross(UP, knob.axis), grip.sign)
  local offset = frames.add(frames.scaled(forward, -grip.back - (away or 0)), knob.axis, grip.out)
  local function turned(v) return frames.rotated(v, knob.axis, angle) end
  return frames.hand(frames.add(knob.middle, turned(offset)), turned(forward), turned(across))
end

-- How far a grip can turn towards `wanted` (rad, signed) while the hand keeps clear of the other objects.
local function reach_of(scene, knob, grip, angle, wanted)
  local sign, turn = wanted < 0 and -1 or 1, 0
  while turn < math.abs(wanted) do
    local next_turn = math.min(turn + CHECK_STEP, math.abs(wanted))
    local pose = hand(knob, grip, angle + sign * next_turn)
    if scene:clearance(pose, { width = grip.width, ignore = { knob.object.name } }) < CLEARANCE then break end
    turn = next_turn
  end
  return sign * turn
end

-- Grips of the knob that keep clear of everything when grasped, best first: { tilt, back, out, width, angle, sign, turn
-- }.
local function grips(scene, knob, wanted)
  local list, hints = {}, knob.part.hints
  -- Across the faces the hand closes horizontally at a joint of 0; across the ends a quarter turn from there.
  for _, faces in ipairs { { hints.grip_width_m, 0 }, { hints.grip_length_m, math.pi / 2 } } do
    local angle = (knob.part.joint + faces[2] + math.pi / 2) % math.pi - math.pi / 2
    for _, tilt in ipairs(TILTS) do
      for _, back in ipairs(BACK) do
        for _, out in ipairs(OUT) do
          local grip = { tilt = tilt, back = back, out = out, width = faces[1], angle = angle, sign = 1 }
          local open = { width = math.min(softvt.hand().stroke, grip.width + 2 * GRIP_CLEARANCE) }
          if scene:clearance(hand(knob, grip, angle), open) >= CLEARANCE then
            grip.turn = reach_of(scene, knob, grip, angle, wanted)
            if math.abs(grip.turn) >= math.min(LEAST_STROKE, math.abs(wanted)) then list[#list + 1] = grip end
            break
          end
        end
      end
    end
  end
  -- Among equal turns the first one tried is best.
  for k, grip in ipairs(list) do
    grip.order = k
  end
  table.sort(list, function(a, b)
    if a.turn ~= b.turn then return math.abs(a.turn) > math.abs(b.turn) end
    return a.order < b.order
  end)
  return list
end

-- Moves to the first grip that the arm reaches, from either side of the hand, and returns it; nil if it reaches none.
local function reach(arm, knob, list)
  for k = 1, math.min(#list, MOST_GRIPS) do
    local grip, paths = list[k], {}
    for i, sign in ipairs { 1, -1 } do
      grip.sign = sign
      paths[i] = { hand(knob, grip, grip.angle, APPROACH), hand(knob, grip, grip.angle) }
    end
    local side = posture.first(arm, paths, { speed = 0.4, angular_speed = 1, closure = clear_closure(arm, grip) })
    if side then
      grip.sign = side == 1 and 1 or -1
      return grip
    end
  end
end

-- Turns the grasped knob by an angle, rad. It ends early where the arm no longer follows: at the limit of the wrist.
local function turn(arm, knob, grip, by, speed)
  local steps = math.max(1, math.ceil(PEAK * math.abs(by) / speed / arm.dt))
  for step = 1, steps do
    arm:command(hand(knob, grip, grip.angle + by * smooth(step / steps)), arm.closure)
    local metres, radians = arm.pose:distance(arm.target)
    if metres > MOST_LAG[1] or radians > MOST_LAG[2] then
      arm:command(arm.pose, arm.closure)
      break
    end
  end
  arm:wait(0.2)
end

local function stroke(arm, scene, spec, home)
  local knob = knob_of(arm, scene, spec.joint)
  local wanted = spec.angle - knob.part.joint
  wanted = math.max(-LARGEST_STROKE, math.min(LARGEST_STROKE, wanted))
  local grip = reach(arm, knob, grips(scene, knob, wanted))
  if not grip then
    local at = knob.part.joint
    arm:give_up(("%s is at %.2f rad and no grasp turns it further towards %.2f rad"):format(spec.joint, at, spec.angle))
  end
  posture.clamp(arm, grip.width)
  turn(arm, knob, grip, grip.turn, spec.speed)
  arm:release { closure = clear_closure(arm, grip) }
  local forward = frames.forward(arm.target)
  arm:move_by(frames.scaled(forward, -APPROACH), { speed = 0.25 })
  posture.down(arm, home)
end

local function make(_, spec, surplus)
  if surplus ~= nil then error("knob: expected one table", 2) end
  softvt.check_fields("knob", spec, FIELDS)
  local full = { joint = spec.joint, angle = spec.angle, speed = spec.speed or SPEED }
  if math.abs(full.angle) > 2 * math.pi then
    local expected = "radians up to a full turn"
    error(("knob: angle: expected %s, got %g; math.rad converts degrees"):format(expected, full.angle), 2)
  end
  if full.speed <= 0 or full.speed > 2.5 then
    error(("knob: speed: expected rad/s in 0..2.5, above 0, got %g"):format(full.speed), 2)
  end
  local function run(arm, scene)
    local home = arm.target.position
    posture.down(arm, home)
    for _ = 1, STROKES do
      if math.abs(knob_of(arm, scene, full.joint).part.joint - full.angle) <= TOLERANCE then break end
      stroke(arm, scene, full, home)
    end
    local at = knob_of(arm, scene, full.joint).part.joint
    if math.abs(at - full.angle) > TOLERANCE then
      arm:give_up(("%s ends at %.2f rad after %d strokes"):format(full.joint, at, STROKES))
    end
  end
  return softvt.check_names("knob", run, full, { joint = "joint", angle = "value of joint" })
end

return setmetatable({}, { __name = "knob", __call = make })
