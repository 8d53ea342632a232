-- Picks an object up and places it on or in another: approach, grasp, lift, carry, place, release, retreat.
--
--   expert = pick_place { object = "left", target = "plate" }
--
-- The grip is drawn uniformly from a part of the safe window (`window`, 0.8 of it, around `share`, its middle), so that
-- demonstrations do not tell one width per object. The hand closes slowly from before first contact (`closing_speed`,
-- 0.008 m/s). `stop = "touch"` ends closing by the force on the pads instead of the width of the gels, as does a grasp
-- that is turned or off-centre because of clearance. `closure` commands one closure instead. `to` places the object
-- near the target, on the same support: "near", or as seen from the robot "left_of", "right_of", "in_front_of" or
-- "behind", with `distance` (m) between the centres.
--
-- `stack = true` places for stacking: the object is centred again above the target, lowered slowly until it presses
-- lightly, and released once it rests; the hand leaves it slowly once it rests again.
local grasp = require "experts.grasp"
local places = require "experts.places"
local route = require "experts.route"
local blind_grips = require "experts.blind_grips"

local FIELDS = {
  object = "string",
  target = "string",
  closure = "number?",
  speed = "number?",
  window = "number?",
  share = "number?",
  stop = "string?",
  closing_speed = "number?",
  to = "string?",
  distance = "number?",
  stack = "boolean?",
}
-- Default part of the safe window and its middle (0 is the loose end, 1 the tight one), and speed of closing in
-- contact, m/s.
local WINDOW, MIDDLE, CLOSING_SPEED = 0.8, 0.5, 0.008
-- Clearance above obstacles while carrying, above the target at release, and around the fingers, m.
local CARRY_CLEARANCE, RELEASE_HEIGHT, FINGER_CLEARANCE = 0.025, 0.001, 0.002
-- Size from which an object is the support of the scene, m.
local SUPPORT = 0.5
-- Fraction of a lift that a held object must follow.
local MIN_LIFT_FRACTION = 0.5
-- Grasp attempts, and the largest displacement of the object before an attempt, m.
local ATTEMPTS, MAX_DISPLACEMENT = 3, 0.08
-- Largest factor of the usual speeds, with which the fastest motion is within the limits of the arm.
local MAX_PACE = 3
-- Random variation of the speed (relative), so that demonstrations differ.
local SPEED_SPREAD = 0.12

-- Placing for stacking: speed of lowering, m/s; how far the object yields in the hand when it presses lightly, and the
-- largest way down to there, m; rate of opening, 1/s; speed of leaving, m/s, and its way, m.
local PRESS = { speed = 0.01, yield = 3e-4, travel = 0.01, rate = 0.2, leave_speed = 0.05, leave = 0.02 }
-- An object rests below this speed, m/s, for this time, s. The longest wait, s.
local REST = { speed = 0.002, seconds = 0.2, limit = 2 }

local function spread(most) return (2 * math.random() - 1) * most end

-- Grasps the object and lifts it off its support; `close` is the grip of a controller in place of the expert's. Returns
-- the grasp { height, width } (m), or nil and the reason.
local function pick(arm, scene, spec, pace, share, close)
  local object = scene:object(spec.object)
  local height = grasp.height(object)
  local chosen = grasp.choose(scene, object, height, { spread(grasp.SPREAD), spread(grasp.SPREAD) })
  local at, opening = chosen.pose, chosen.closure
  if chosen.clearance < 0 then
    local reason = "leaves no clearance for the hand: %s is %.1f mm in its way"
    return nil, reason:format(chosen.nearest, -1e3 * chosen.clearance)
  end
  local over = route.approach_height(scene, arm.pose.position, at, 0.05, FINGER_CLEARANCE)
  arm:move_to(arm.target:at { arm.target.x, arm.target.y, math.max(over, arm.target.z) }, { speed = 0.4 * pace })
  arm:move_to(at:at { at.x, at.y, over }, { speed = 0.4 * pace, closure = opening })
  arm:move_to(at, { speed = 0.25 * pace, closure = opening })
  arm:wait(0.1)
  local before = scene:object(spec.object).centre[3]
  if close then
    close(scene, chosen)
  else
    -- The width of a grip is that where the calibration presses; elsewhere the hand stops by force.
    local grip, stop = grasp.target(object, share), chosen.is_nominal and spec.stop or "touch"
    grasp.close(
      arm,
      object,
      grip,
      { closing_speed = spec.closing_speed, stop = stop, closure = spec.closure, width = chosen.width }
    )
  end
  arm:wait(0.3)
  arm:note("grip_width_mm", 1e3 * arm.width)
  -- Straight up first.
  arm:move_by({ 0, 0, 0.05 }, { speed = 0.2 * pace * grasp.carry_pace(object) })
  if scene:object(spec.object).centre[3] - before > MIN_LIFT_FRACTION * 0.05 then
    return { height = height, width = chosen.width }
  end
  return nil, "was not lifted by the grasp"
end

-- Rotations of the hand for placing, smallest first, rad.
local function place_rotations(object, target)
  local list = { 0 }
  for k = 1, 6 do
    list[#list + 1], list[#list + 2] = k * math.rad(15), -k * math.rad(15)
  end
  -- A long object is aligned with the longer side of a container.
  local long, short = grasp.sides(object)
  if target.hints.wall_m and long > 1.3 * short then
    local turn = (grasp.long_axis_yaw(target) - grasp.long_axis_yaw(object)) % math.pi
    table.insert(list, 1, turn > math.pi / 2 and turn - math.pi or turn)
  end
  return list
end

-- Height of the highest surface of other objects at a point of the target, m; 0 without one.
local function surface_at(scene, point, spec)
  local top, own = 0, spec.target:match "^[^.]+"
  for _, object in ipairs(scene:objects()) do
    local c, s = math.cos(object.yaw), math.sin(object.yaw)
    local dx, dy = point[1] - object.centre[1], point[2] - object.centre[2]
    local along, across = math.abs(c * dx + s * dy), math.abs(c * dy - s * dx)
    local covers = 2 * along < object.size[1] and 2 * across < object.size[2]
    if covers and object.name ~= spec.object and object.name ~= own and object.size[1] < SUPPORT then
      top = math.max(top, grasp.bottom(object) + (object.hints.surface_m or object.size[3]))
    end
  end
  return top
end

-- The release pose: the object above the centre of the target, as low as the clearance of the hand allows.
local function release_pose(arm, scene, spec, held)
  local object, target = scene:object(spec.object), places.state(scene, spec.target)
  local centre, rise = target.centre, target.hints.surface_m or target.size[3]
  if spec.to then
    local beside, problem = places.beside(scene, spec)
    if not beside then arm:give_up(problem) end
    centre, rise = beside, 0
  end
  local surface = math.max(grasp.bottom(target) + rise, surface_at(scene, centre, spec)) + held.height + RELEASE_HEIGHT
  local width = arm.stroke * (1 - grasp.clear_closure(object, nil, held.width))
  -- The object's offset from the tool rotates with the hand.
  local dx, dy = object.centre[1] - arm.pose.x, object.centre[2] - arm.pose.y
  local best, rotations = nil, place_rotations(object, target)
  for up = 0, 20 do
    for _, turn in ipairs(rotations) do
      local c, s = math.cos(turn), math.sin(turn)
      local x, y = centre[1] - (c * dx - s * dy), centre[2] - (s * dx + c * dy)
      local pose = arm.target:rotated(turn):at { x, y, surface + 0.005 * up }
      local clearance = scene:clearance(pose, { width = width, ignore = { spec.object } })
      if not best or clearance > best.clearance then best = { pose = pose, clearance = clearance } end
      if clearance >= FINGER_CLEARANCE then return pose end
    end
  end
  return best.pose
end

-- Waits until an object rests.
local function wait_for_rest(arm, scene, name)
  local still, last = 0, scene:object(name).centre
  for _ = 1, math.ceil(REST.limit / arm.dt) do
    arm:wait(arm.dt)
    local now = scene:object(name).centre
    local moved = math.sqrt((now[1] - last[1]) ^ 2 + (now[2] - last[2]) ^ 2 + (now[3] - last[3]) ^ 2)
    still = moved < REST.speed * arm.dt and still + arm.dt or 0
    if still >= REST.seconds then return end
    last = now
  end
end

-- Lowers the object slowly until it yields in the hand, which shows a light press. Returns true if it does.
local function press(arm, scene, name)
  local function yields() return scene:object(name).centre[3] - arm.pose.z end
  local free = yields()
  for _ = 1, math.ceil(PRESS.travel / (PRESS.speed * arm.dt)) do
    if yields() - free > PRESS.yield then return true end
    arm:command(arm.target:translated { 0, 0, -PRESS.speed * arm.dt }, arm.closure)
  end
  return false
end

-- Releases the object of a grasp { height, width } on the target, above which the hand holds it.
local function stack(arm, scene, spec, held, over, pace)
  local object = scene:object(spec.object)
  -- What was held may have moved in the hand on the way.
  local pose = release_pose(arm, scene, spec, held)
  arm:move_to(pose:at { pose.x, pose.y, over }, { speed = 0.1 * pace })
  wait_for_rest(arm, scene, spec.object)
  arm:move_to(pose:at { pose.x, pose.y, pose.z + 0.003 }, { speed = 0.15 * pace })
  if not press(arm, scene, spec.object) then
    arm:give_up(("%s does not meet %s below it"):format(spec.object, spec.target))
  end
  wait_for_rest(arm, scene, spec.object)
  arm:release { closure = grasp.clear_closure(object, nil, held.width), rate = PRESS.rate }
  wait_for_rest(arm, scene, spec.object)
  arm:move_by({ 0, 0, PRESS.leave }, { speed = PRESS.leave_speed })
end

-- Carries the object of a grasp { height, width } to the target and releases it there.
local function place(arm, scene, spec, held, pace)
  local object = scene:object(spec.object)
  pace = pace * grasp.carry_pace(object)
  local target_pose = release_pose(arm, scene, spec, held)
  local carried = { object = object, below = held.height }
  local over = math.max(
    target_pose.z + 0.03,
    route.carry_height(scene, arm.pose.position, target_pose.position, carried, CARRY_CLEARANCE)
  )
  arm:move_to(arm.target:at { arm.target.x, arm.target.y, math.max(over, arm.target.z) }, { speed = 0.25 * pace })
  arm:move_to(target_pose:at { target_pose.x, target_pose.y, over }, { speed = 0.4 * pace })
  if spec.stack then
    stack(arm, scene, spec, held, over, pace)
  else
    arm:move_to(target_pose, { speed = 0.2 * pace })
    arm:wait(0.2)
    -- Opens only as far as needed, since a rim or a wall may be close.
    arm:release { closure = grasp.clear_closure(object, nil, held.width), rate = 0.4 }
    arm:wait(0.1)
  end
  arm:move_by({ 0, 0, math.max(0.08, over - target_pose.z) }, { speed = 0.25 * pace })
end

-- The specification with its defaults. An error names the field.
local function complete(spec)
  local full = {}
  for key, value in pairs(spec) do
    full[key] = value
  end
  full.window, full.stop = spec.window or WINDOW, spec.stop or "width"
  full.closing_speed, full.share = spec.closing_speed or CLOSING_SPEED, spec.share or MIDDLE
  local function refuse(key, expected)
    error(("pick_place: %s: expected %s, got %s"):format(key, expected, tostring(full[key])), 4)
  end
  if full.closure and (full.closure < 0 or full.closure > 1) then refuse("closure", "a closure in 0..1") end
  if full.speed and (full.speed <= 0 or full.speed > MAX_PACE) then
    refuse("speed", ("a factor of the usual speeds in 0..%g, above 0"):format(MAX_PACE))
  end
  if full.window < 0 or full.window > 1 then refuse("window", "a share in 0..1") end
  local room = 0.5 * full.window
  if full.share < room or full.share > 1 - room then
    refuse("share", ("a share in %g..%g, so that the part is within the window"):format(room, 1 - room))
  end
  if full.stop ~= "width" and full.stop ~= "touch" then refuse("stop", '"width" or "touch"') end
  if full.distance and not full.to then refuse("distance", "nothing without `to`, which places near the target") end
  places.check("pick_place", full, 4)
  if full.to and full.stack then refuse("stack", "nothing with `to`, which places near the target") end
  if full.closing_speed < 1e-4 or full.closing_speed > 0.2 then refuse("closing_speed", "m/s in 0.0001..0.2") end
  return full
end

local function make(_, spec, surplus)
  if surplus ~= nil then error("pick_place: expected one table", 2) end
  softvt.check_fields("pick_place", spec, FIELDS)
  spec = complete(spec)
  local function run(arm, scene)
    local pace = (spec.speed or 1) * (1 + spread(SPEED_SPREAD))
    local share = spec.share + spread(0.5 * spec.window)
    local problem = grasp.problem(scene:object(spec.object))
    if problem then arm:give_up(spec.object .. " " .. problem) end
    local controller = arm.grip_controller
    local close = controller and blind_grips.controller(controller, arm, scene:object(spec.object))
    if not (spec.closure or close) and grasp.window(scene:object(spec.object)) then arm:note("grip_share", share) end
    local first, reason = scene:object(spec.object).centre, nil
    for _ = 1, ATTEMPTS do
      -- An object that has slid or rolled away is not followed.
      local now = scene:object(spec.object).centre
      local moved = math.sqrt((now[1] - first[1]) ^ 2 + (now[2] - first[2]) ^ 2)
      if moved > MAX_DISPLACEMENT then
        arm:give_up(("%s has moved by %.0f mm; grasping it again is not attempted"):format(spec.object, 1e3 * moved))
      end
      local held
      held, reason = pick(arm, scene, spec, pace, share, close)
      if held then return place(arm, scene, spec, held, pace) end
      -- Release, retreat and try again.
      arm:open()
      arm:move_by({ 0, 0, 0.03 }, { speed = 0.25 })
    end
    arm:give_up(("%s %s (%d attempts)"):format(spec.object, reason, ATTEMPTS))
  end
  return softvt.check_names("pick_place", run, spec, { object = "object", target = "place" })
end

return setmetatable({}, { __name = "pick_place", __call = make })
