-- What an expert drives: motions that each last as many control steps as they need, built on one primitive that sends a
-- command and waits for the next control step. Poses are of the tool centre point, in the world frame.
local host, check, servo, fingers = ...
local yield, ceil, max = coroutine.yield, math.ceil, math.max

local Arm = {}

-- Largest slope of the quintic below: the mean speed of a motion is the limit divided by it.
local PEAK = 1.875

-- Minimum-jerk share of the way (Flash and Hogan, 1985).
local function smooth(u) return u * u * u * (10 + u * (6 * u - 15)) end

-- From here on no servo holds, and nobody feels.
local function let_go(self) self.holds, self.feeling = nil, false end

-- Sends one command and comes back at the next control step, or with what is wrong with it. A servo that holds something
-- may close further than it is told.
function Arm:command(pose, closure)
  if self.holds then
    self.holds = servo.keep(max(self.holds, closure), fingers.felt())
    closure = self.holds
  end
  self.target, self.closure = pose, closure
  local refusal = yield(self.target, self.closure, self.gripping, nil, self.feeling)
  if refusal then check.refuse(refusal) end
end

-- What the fingers feel in this control step. They are looked at only where somebody asks, and then from the next one on.
function Arm:feel()
  if not fingers.feel then check.refuse("arm:feel: fingers are felt in simulation:drive and under --policy tactile-servo") end
  local felt = fingers.felt()
  if felt then return felt end
  local before = self.feeling
  self.feeling = true
  self:command(self.target, self.closure)
  self.feeling = before
  return fingers.felt()
end

local function travel(self, pose, options, closure)
  local from, start = self.target, self.closure
  if closure < start then let_go(self) end
  local metres, radians = from:distance(pose)
  local seconds = PEAK * max(metres / options.speed, radians / options.turn)
  local steps = max(1, ceil(seconds / host.dt))
  for step = 1, steps do
    local share = smooth(step / steps)
    self:command(from:towards(pose, share), start * (1 - share) + closure * share)
  end
end

-- Moves straight and smoothly; options: speed (m/s), turn (rad/s), closure to reach on the way.
function Arm:move_to(pose, options)
  options = check.options("arm:move_to", options, { speed = 0.25, turn = 1.5, closure = self.closure })
  travel(self, pose, options, options.closure)
end

-- Moves by an offset in the world frame, m.
function Arm:move_by(offset, options) self:move_to(self.target:moved(offset), options) end

-- Closes or opens to a closure at a rate (1/s: 1 is the whole stroke in a second).
function Arm:close_to(closure, options)
  options = check.options("arm:close_to", options, { rate = 0.5 })
  local start = self.closure
  if closure < start then let_go(self) end
  local way = closure - start
  local steps = max(1, ceil((way < 0 and -way or way) / options.rate / host.dt))
  for step = 1, steps do self:command(self.target, start * (1 - step / steps) + closure * (step / steps)) end
end

-- Closes on an object: to the closure that the expert knows, or, as a servo, until the fingers feel it. A binary gripper,
-- which knows only open and shut, shuts here and not in close_to.
function Arm:grasp(closure, options)
  self.gripping = true
  if not fingers.servo then return self:close_to(closure, options) end
  options = check.options("arm:grasp", options, { rate = 0.5 })
  let_go(self)
  self.feeling = true
  self.holds = servo.close(self.closure, options.rate * host.dt, function(next)
    self:command(self.target, next)
    return fingers.felt()
  end)
end

-- Lets go of an object, opening to a closure (options.closure) or wide.
function Arm:release(options)
  options = check.options("arm:release", options, { rate = 0.5, closure = 0 })
  self.gripping = false
  let_go(self)
  self:close_to(options.closure, { rate = options.rate })
end

-- Opens the gripper wide.
function Arm:open(options)
  self.gripping = false
  let_go(self)
  self:close_to(0, options)
end

-- Holds still for a time, s.
function Arm:wait(seconds)
  for _ = 1, ceil(seconds / host.dt - 1e-9) do self:command(self.target, self.closure) end
end

-- Ends the expert with a reason; the last command stays, and the host never comes back here.
function Arm:give_up(reason) yield(self.target, self.closure, self.gripping, reason) end

local measured = { pose = true, width = true, force = true, time = true, dt = true }
local own = { target = true, closure = true, gripping = true }
local state, methods, arm = { target = host.pose, closure = host.closure, gripping = false, feeling = false }, {}, nil

-- Methods see the state of the arm; scripts see the methods, which check what they are given.
for name, method in pairs(Arm) do
  methods[name] = function(self, ...)
    if self ~= arm then check.no_self(name, self) end
    return method(state, check.arguments(name, ...))
  end
end
setmetatable(state, { __index = Arm })

arm = setmetatable({}, {
  __index = function(_, key)
    if measured[key] then return host[key] end
    if own[key] then return state[key] end
    local method = methods[key]
    if method == nil then check.unknown(key) end
    return method
  end,
  __newindex = function(_, key)
    if not (measured[key] or own[key] or methods[key]) then check.unknown(key) end
    check.refuse("arm." .. key .. ": is only read; the methods of the arm change what it does")
  end,
  __tostring = function() return "softvt.Arm" end,
  __metatable = "softvt.Arm",
})
return arm
