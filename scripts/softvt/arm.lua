-- The arm as experts control it. Each motion takes as many control steps as it needs; all are built on one primitive
-- that sends a command and waits for the next control step. Poses are of the tool centre point, in the world frame.
local host, check, servo, fingers, note, reaches = ...
local yield, ceil, max, min = coroutine.yield, math.ceil, math.max, math.min

local Arm = {}

-- Largest slope of the quintic below. The mean speed of a motion is the speed limit divided by it.
local PEAK = 1.875

-- Minimum-jerk time scaling on [0, 1] (Flash and Hogan, 1985).
local function smooth(u) return u * u * u * (10 + u * (6 * u - 15)) end

-- Lets go of what the tactile servo holds.
local function end_servo(self)
  self.grip, self.wants_readings = nil, false
end

-- Sends one command and returns at the next control step, or raises the error that the host reports. The hand keeps the
-- closure that the servo found.
function Arm:command(pose, closure)
  if self.grip then closure = max(self.grip, closure) end
  self.target, self.closure = pose, closure
  local refusal = yield(self.target, self.closure, self.gripping, nil, self.wants_readings, self.goal)
  if refusal then
    self.goal = nil
    check.refuse(refusal)
  end
end

-- Returns the readings of the fingers in this control step. They are computed on request only, from the next step on.
function Arm:tactile()
  if not fingers.available then
    check.refuse("arm:tactile: finger readings are available in simulation:drive and under --policy tactile-servo")
  end
  local readings = fingers.readings()
  if readings then return readings end
  local before = self.wants_readings
  self.wants_readings = true
  self:command(self.target, self.closure)
  self.wants_readings = before
  return fingers.readings()
end

-- Factor on the duration of a motion with an object that the tactile servo holds: its grip has little to spare for
-- acceleration.
local CAREFUL = 1.3

local function travel(self, pose, options, closure)
  local from, start = self.target, self.closure
  if closure < start then end_servo(self) end
  local metres, radians = from:distance(pose)
  local seconds = PEAK * max(metres / options.speed, radians / options.angular_speed) * (self.grip and CAREFUL or 1)
  local steps = max(1, ceil(seconds / host.dt))
  self.goal = pose
  for step = 1, steps do
    local s = smooth(step / steps)
    self:command(from:interpolate(pose, s), start * (1 - s) + closure * s)
  end
  self.goal = nil
end

-- Moves along a straight line, and to options.closure on the way.
function Arm:move_to(pose, options) travel(self, pose, options, options.closure or self.closure) end

-- Moves by an offset in the world frame, m.
function Arm:move_by(offset, options) self:move_to(self.target:translated(offset), options) end

-- Closes or opens to a closure at a rate (1/s; 1 is the full stroke per second).
function Arm:close_to(closure, options)
  local start = self.closure
  if closure < start then end_servo(self) end
  local change = closure - start
  local steps = max(1, ceil((change < 0 and -change or change) / options.rate / host.dt))
  for step = 1, steps do
    self:command(self.target, start * (1 - step / steps) + closure * (step / steps))
  end
end

-- Lag of the measurements behind the command, s; the trim to the width or the force of a grip: share of the error that
-- a command corrects, largest duration, s, and tolerance, m and as a share of the force.
local LAG = 0.1
local WIDTH_TRIM, FORCE_TRIM =
  { share = 0.5, seconds = 0.5, tolerance = 5e-5 }, { share = 0.15, seconds = 1, tolerance = 0.01 }

-- Force per pad, N: the mean of both, which the support of the object makes unequal until it is lifted.
local function grip_force() return 0.5 * (host.force[1] + host.force[2]) end

-- Closes until the gels are at options.width or the pads press with options.force, at the latest at the closure. The
-- measurements lag behind the command, so closing ends before: width and force are expected to change on at the present
-- rate. They are then trimmed, which also corrects what the compliance of the fingers adds to the width.
local function close_until(self, closure, options)
  local rate, width, force = options.rate, options.width, options.force
  local step, pressed, rise = rate * host.dt, 0, 0
  while self.closure < closure do
    local now = grip_force()
    pressed, rise = now, max(0, now - pressed)
    local both_touch = min(host.force[1], host.force[2]) > 0
    if force and both_touch and pressed + LAG / host.dt * rise >= force then break end
    if width and host.width - LAG * rate * host.stroke <= width then break end
    self:command(self.target, min(closure, self.closure + step))
  end
  local trim = width and WIDTH_TRIM or FORCE_TRIM
  for _ = 1, ceil(trim.seconds / host.dt) do
    -- What is missing, as a change of closure. The force is taken to grow on by `rise` per step of closing.
    local missing, tolerance
    if width then
      missing, tolerance = (host.width - width) / host.stroke, trim.tolerance / host.stroke
    else
      missing = rise > 0 and step * (force - grip_force()) / rise or 0
      tolerance = rise > 0 and step * trim.tolerance * force / rise or 0
    end
    if missing <= tolerance then return end
    self:command(self.target, min(closure, self.closure + trim.share * missing))
  end
end

-- Distance within which a grasp repeats the last one, m: the other side of a rim may be grasped the next time.
local SAME_PLACE = 0.12

-- Number of grasps that have failed here: those since the last release or grasp elsewhere.
local function failed_grasps(self)
  local before = self.grasped_at
  self.grasped_at = self.target
  return before and before:distance(self.target) < SAME_PLACE and self.failures + 1 or 0
end

-- Direction from the right finger to the left one of a hand at a pose, in the world frame.
local function towards_left(pose)
  local w, x, y, z = table.unpack(pose.quaternion)
  return { 2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x) }
end

-- Grasps with the tactile servo, which lifts the hand by a few millimetres, moves it sideways and returns to the height
-- of the grasp.
local function feel(self)
  end_servo(self)
  self.wants_readings = true
  self.failures = failed_grasps(self)
  local at, left = self.target, towards_left(self.target)
  self.grip = servo.grasp(self.closure, self.failures, function(closure, height, shift)
    self:command(at:translated { shift * left[1], shift * left[2], shift * left[3] + height }, closure)
    return fingers.readings()
  end)
  self.wants_readings = false
end

-- Closes on an object: to the given closure, or with the tactile servo, which feels how firmly the object must be held.
-- A binary gripper closes fully here, and not in close_to.
function Arm:grasp(closure, options)
  self.gripping = true
  if host.grip_controller and not self.knows_controller then
    check.refuse(
      ("arm:grasp: the expert has no grip for --policy %s; let it read arm.grip_controller, as experts.pick_place does, or choose another policy"):format(
        host.grip_controller
      )
    )
  end
  if options.width and options.force then
    check.refuse("arm:grasp: closing stops at options.width or at options.force; give one of them")
  end
  local least = host.stroke * (1 - closure)
  if options.width and options.width < least - 1e-9 then
    check.refuse(
      ("arm:grasp: closing ends at a closure of %g, %g mm wide, and never reaches options.width, %g mm; close to %.3g or more"):format(
        closure,
        1e3 * least,
        1e3 * options.width,
        math.ceil(1e3 * (1 - options.width / host.stroke)) / 1e3
      )
    )
  end
  if fingers.servo then return feel(self) end
  if options.width or options.force then return close_until(self, closure, options) end
  self:close_to(closure, options)
end

-- Releases an object by opening to options.closure (default: fully open).
function Arm:release(options)
  self.gripping, self.grasped_at = false, nil
  end_servo(self)
  self:close_to(options.closure, { rate = options.rate })
end

-- Opens the gripper fully.
function Arm:open(options)
  self.gripping = false
  end_servo(self)
  self:close_to(0, options)
end

-- Keeps the pose for a time, s.
function Arm:wait(seconds)
  for _ = 1, ceil(seconds / host.dt - 1e-9) do
    self:command(self.target, self.closure)
  end
end

-- Returns true if the arm gets to a pose, or false and the distance at which it stops, m.
function Arm:reaches(pose) return reaches(host, pose) end

-- Notes a number in the record of the episode.
function Arm:note(name, value) note(name, value) end

-- Ends the expert with a reason. The last command stays in effect, and the coroutine is not resumed.
function Arm:give_up(reason) yield(self.target, self.closure, self.gripping, reason) end

-- An expert that reads the name of the controller is taken to follow it.
local own = { target = true, closure = true, gripping = true, feels = true }
local state, methods, arm =
  {
    target = host.target,
    closure = host.closure,
    gripping = host.gripping,
    feels = fingers.servo,
    wants_readings = false,
  }, {}, nil

-- Methods work on the state of the arm; scripts get wrappers that check their arguments.
for name, method in pairs(Arm) do
  methods[name] = function(self, ...)
    if self ~= arm then check.missing_self_error(name, self) end
    return method(state, check.arguments(name, ...))
  end
end
setmetatable(state, { __index = Arm })

arm = setmetatable({}, {
  __index = function(_, key)
    if key == "grip_controller" then state.knows_controller = true end
    if own[key] then return state[key] end
    return methods[key] or host[key]
  end,
  __newindex = function(_, key, value) host[key] = value end,
  __tostring = function() return "softvt.Arm" end,
  __metatable = "softvt.Arm",
})
return arm
