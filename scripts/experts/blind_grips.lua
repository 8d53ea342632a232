-- Grips of controllers that do not feel the instance in the hand. They know what shows of an object (its kind, size and
-- pose) and the statistics of the suite. Each keeps one number constant for all instances of a kind, scaled by a power
-- of the size: the number that is inside of the safe windows of the largest share of the instances that the suite
-- draws.
--
-- look-retry and weigh keep no number constant: they lift, look whether the object follows or weigh what hangs on the
-- arm, and close further.
local grasp = require "experts.grasp"
local trial_constants = require "experts.trial_constants"

local blind_grips = {}

-- Instances of a kind that a number is optimised over.
local INSTANCES = 600
local hand = softvt.hand()
local STROKE = hand.stroke
-- Largest speed of closing in contact, m/s, share of an error that is corrected per control step, largest duration, s,
-- and tolerance, m. The measured width lags by two steps behind its command; a larger share would overshoot.
local SPEED, SHARE, DURATION, TOLERANCE = 0.004, 0.15, 4, 1e-5
-- Force on each pad that counts as contact, N.
local CONTACT_FORCE = 0.005
-- Resolution of the width that the drives measure, m; steps of a hand that reads it, before and after contact, m, and
-- time for each, s.
local DRIVE_RESOLUTION, DRIVE_FAST, DRIVE_STEP, DRIVE_WAIT = 1e-4, 2e-4, 1e-4, 0.1
-- Gap that such a hand has on average when it first reads one, m: a reading rounds, and a step passes the threshold by
-- half of itself.
local CONTACT_GAP = 0.75 * DRIVE_RESOLUTION
-- Height (m) and speed (m/s) of a trial lift.
local TRIAL_HEIGHT, TRIAL_SPEED = 0.004, 0.05
-- Time after which the arm has come to rest from its approach to a micrometre, s.
local REST = 1
-- Error of a look, m (1 sd). The wrist camera has 2 mm per pixel at 128 pixels; the position of an outline some 25
-- pixels wide is known to a third of a pixel.
local LOOK_ERROR = 0.0007
-- Share of the sample that needs less indentation than the loosest grip that trials start from.
local LOOSEST = 0.03

-- Powers of the size by which a number may scale.
local SIZE_POWERS = { 0, 1, 2, 3 }

local function clamp(closure) return math.max(0, math.min(1, closure)) end

-- The number inside the largest count of the intervals [lows[i], highs[i]]: the middle of the first such range. Returns
-- it with the count.
local function most_common(lows, highs)
  table.sort(lows)
  table.sort(highs)
  local passed, most, best = 0, 0, nil
  for index, low in ipairs(lows) do
    while highs[passed + 1] < low do
      passed = passed + 1
    end
    if index - passed > most then
      most, best = index - passed, (low + highs[passed + 1]) / 2
    end
  end
  return best, most
end

-- Indentation of a grip after first contact, of both pads together, m.
local function depth(grip, window) return window.contact - grip.width end

-- Depth of its command below first contact, m: what the spring of the drives adds to the indentation is that of the
-- force.
local function command_depth(grip, window, stiffness) return window.contact - grasp.command_width(grip, stiffness) end

local function force_of(grip) return grip.force end

-- Indentation at a force, m, by the power law through the ends of a window.
local function depth_at(window, force)
  local loose, tight = math.max(1e-6, depth(window.loose, window)), math.max(2e-6, depth(window.tight, window))
  local power = math.log(window.tight.force / window.loose.force) / math.log(tight / loose)
  return power > 0 and loose * (force / window.loose.force) ^ (1 / power) or 0
end

-- Sends closures until `missing` has settled at 0: the distance, in m of command, by which the hand is too loose
-- (negative: too tight).
local function settle(arm, missing)
  local quiet, most = 0, SPEED * arm.dt
  for _ = 1, math.ceil(DURATION / arm.dt) do
    local step = math.max(-most, math.min(most, SHARE * missing()))
    quiet = math.abs(step) < SHARE * TOLERANCE and quiet + 1 or 0
    if quiet == 3 then return end
    arm:command(arm.target, clamp(arm.closure + step / STROKE))
  end
end

-- Closes slowly until both pads touch.
local function close_to_contact(arm)
  local step = 0.5 * SPEED * arm.dt / STROKE
  while arm.closure < 1 and math.min(arm.force[1], arm.force[2]) < CONTACT_FORCE do
    arm:command(arm.target, clamp(arm.closure + step))
  end
end

-- Rate of closing to a command, 1/s.
local RATE = 2 * SPEED / STROKE

local function close_to_command(arm, width) arm:grasp(clamp(1 - width / STROKE), { rate = RATE }) end

-- Closes until both pads press with a force.
local function close_to_force(arm, force)
  close_to_contact(arm)
  settle(arm, function() return 2 * (force - 0.5 * (arm.force[1] + arm.force[2])) / arm.finger_stiffness end)
end

-- Products of the force and a power of the indentation, which the drives measure: 0 is the force alone, a large one the
-- indentation alone.
local function drive_numbers()
  local list = {}
  for _, power in ipairs { 0, 0.5, 1, 2, 4 } do
    list[#list + 1] = {
      power = power,
      of = function(grip, window, stiffness)
        local beyond = depth(grip, window) - depth_at(window, CONTACT_GAP * (stiffness or hand.finger_stiffness) / 2)
        return grip.force * math.max(0, 1e3 * beyond) ^ power
      end,
    }
  end
  return list
end

-- Closes in steps and reads the gap of the commanded and the measured width after each: half of it is the displacement
-- of the spring of a finger.
local function close_by_drives(arm, number, power)
  local function read(value) return math.floor(value / DRIVE_RESOLUTION + 0.5) * DRIVE_RESOLUTION end
  local function gap() return arm.width - STROKE * (1 - arm.closure) end
  arm:wait(2 * DRIVE_WAIT)
  local rest, contact = gap(), nil
  while arm.closure < 1 do
    close_to_command(arm, STROKE * (1 - arm.closure) - (contact and DRIVE_STEP or DRIVE_FAST))
    arm:wait(DRIVE_WAIT)
    local force, width = arm.finger_stiffness * read(gap() - rest) / 2, read(arm.width)
    if not contact and force > 0 then contact = width end
    if contact and force * math.max(0, 1e3 * (contact - width)) ^ power >= number then return end
  end
end

-- By controller: the numbers that it may keep constant, as functions of a grip { width, force }, the window of its
-- instance and the stiffness of the drives (N/m, default that of the standard hand), which rise as the hand closes; the
-- powers of the size; and the motion of the hand, given the number and the width of first contact, m.
local LAWS = {
  ["fixed-closure"] = {
    numbers = { { of = function(grip, _, stiffness) return grasp.command(grip, stiffness) end } },
    size_powers = { 0 },
    close = function(arm, number) arm:grasp(clamp(number), { rate = RATE }) end,
  },
  ["size-seen"] = {
    numbers = { { of = command_depth } },
    size_powers = SIZE_POWERS,
    close = function(arm, number, contact) close_to_command(arm, contact - number) end,
  },
  ["contact-depth"] = {
    numbers = { { of = depth } },
    size_powers = SIZE_POWERS,
    close = function(arm, number)
      close_to_contact(arm)
      local width = arm.width - number
      settle(arm, function() return arm.width - width end)
    end,
  },
  ["one-force"] = {
    numbers = { { of = force_of } },
    size_powers = SIZE_POWERS,
    close = close_to_force,
  },
  ["one-force-for-all"] = {
    numbers = { { of = force_of } },
    size_powers = { 0 },
    all_kinds = true,
    close = close_to_force,
  },
  drives = {
    numbers = drive_numbers(),
    size_powers = SIZE_POWERS,
    close = function(arm, number, _, power) close_by_drives(arm, number, power) end,
  },
}

-- Names of the controllers that do not feel, in the order of tables.
blind_grips.names = { "fixed-closure", "size-seen", "contact-depth", "one-force", "one-force-for-all", "drives" }

-- Instances with a window, as { instance, window } each, of the sample of an object in the scene or of a kind. Also
-- returns the share of the draws that the suite keeps.
local function with_windows(instances, name, count, stiffness)
  local list, draws = { stiffness = stiffness }, 0
  for _, other in ipairs(instances:sample(name, count)) do
    local window = grasp.window(other)
    if window and grasp.command(window.loose, stiffness) <= grasp.command(window.tight, stiffness) then
      list[#list + 1] = { instance = other, window = window }
    end
    draws = draws + other.draws
  end
  return list, count / draws
end

-- The sample that the number of a controller is optimised over: instances of the kind of an object in the scene, or of
-- all kinds.
function blind_grips.sample(name, instances, object, count, stiffness)
  if not LAWS[name].all_kinds then return with_windows(instances, object, count or INSTANCES, stiffness) end
  local list = { stiffness = stiffness }
  for _, kind in ipairs(instances:kinds()) do
    local own = with_windows(instances, kind, count or INSTANCES, stiffness)
    table.move(own, 1, #own, #list + 1, list)
  end
  return list
end

-- The number of a controller that is inside of the windows of most instances of a sample: { value, size_power, of,
-- power, share }, or nil for an empty sample.
function blind_grips.best(name, sample)
  local law, best = LAWS[name], nil
  for _, number in ipairs(law.numbers) do
    local function of(grip, window) return number.of(grip, window, sample.stiffness) end
    for _, size_power in ipairs(law.size_powers) do
      local lows, highs = {}, {}
      for index, one in ipairs(sample) do
        local factor = one.instance.scale ^ size_power
        lows[index] = of(one.window.loose, one.window) / factor
        highs[index] = math.max(lows[index], of(one.window.tight, one.window) / factor)
      end
      local value, count = most_common(lows, highs)
      if value and (not best or count > best.count) then
        best = {
          value = value,
          size_power = size_power,
          of = of,
          power = number.power,
          count = count,
          share = count / #sample,
        }
      end
    end
  end
  return best
end

-- Share of a sample whose windows contain the number of `best`.
function blind_grips.share(best, sample)
  local inside = 0
  for _, one in ipairs(sample) do
    local number = best.value * one.instance.scale ^ best.size_power
    local low, high = best.of(one.window.loose, one.window), best.of(one.window.tight, one.window)
    if low <= number and number <= high then inside = inside + 1 end
  end
  return inside / #sample
end

-- A normally distributed error, by the method of Box and Muller.
local function normal(deviation)
  return deviation * math.sqrt(-2 * math.log(1 - math.random())) * math.cos(2 * math.pi * math.random())
end

-- Mean height of an object in some looks, m.
local function look(arm, scene, name, looks)
  local sum = 0
  for _ = 1, looks do
    arm:wait(arm.dt)
    sum = sum + scene:object(name).centre[3] + normal(LOOK_ERROR)
  end
  return sum / looks
end

-- A trial lift, with `sense` at its top.
local function lift(arm, chosen, sense)
  arm:move_to(chosen.pose:translated { 0, 0, TRIAL_HEIGHT }, { speed = TRIAL_SPEED })
  local sensed = sense()
  arm:move_to(chosen.pose, { speed = TRIAL_SPEED })
  return sensed
end

-- By controller that finds the grip of an instance by trial: a function of the arm, the scene, the grasp, the name of
-- the object and the constants of the controller, called before the hand closes. It returns a function that lifts the
-- hand by some millimetres and returns true if the object is held, with the number of earlier trials in which it was.
local TRIALS = {
  -- Looks whether the object follows the hand.
  ["look-retry"] = function(arm, scene, chosen, name, constants)
    return function()
      local before = look(arm, scene, name, constants.looks)
      local at_top = lift(arm, chosen, function() return look(arm, scene, name, constants.looks) end)
      return at_top - before > constants.follows * TRIAL_HEIGHT, 0
    end
  end,
  -- Weighs what the arm carries by the height at which it hangs below its command: its drives are springs. Pads that
  -- slide along an object carry more the more they press; an object that is held weighs the same in the next grip.
  weigh = function(arm, _, chosen, _, constants)
    local function droop()
      arm:wait(constants.seconds)
      return lift(arm, chosen, function()
        arm:wait(constants.seconds)
        return arm.target.z - arm.pose.z
      end)
    end
    arm:wait(REST)
    local free, last = droop(), 0
    return function()
      local load = droop() - free
      local is_held = last > 0 and load < constants.growth * last
      last = load
      return is_held, 1
    end
  end,
}

-- Starts loose for the seen size, lifts by some millimetres, and closes further until the object is held; then closes
-- to the least grip that held and a margin. Repeated grasps begin where the last one ended.
local function by_trial(name, arm, object)
  local constants, depths, tightest = trial_constants[name], {}, 0
  local stiffness = arm.finger_stiffness
  for index, one in ipairs((with_windows(arm.instances, object.name, INSTANCES, stiffness))) do
    depths[index] = command_depth(one.window.loose, one.window, stiffness) / one.instance.scale
    tightest = math.max(tightest, command_depth(one.window.tight, one.window, stiffness) / one.instance.scale)
  end
  if #depths == 0 then return nil end
  table.sort(depths)
  local indentation = constants.start * depths[math.ceil(LOOSEST * #depths)] * object.scale
  return function(scene, chosen, contact)
    local try = TRIALS[name](arm, scene, chosen, object.name, constants)
    while true do
      close_to_command(arm, contact - indentation)
      arm:wait(2 * arm.dt)
      local is_held, ago = try()
      if is_held then
        indentation = indentation / constants.tighter ^ ago
        break
      end
      if indentation > tightest * object.scale then break end
      indentation = indentation * constants.tighter
    end
    indentation = indentation * constants.margin
    close_to_command(arm, contact - indentation)
  end
end

-- The grip of a controller for an object: close(scene, chosen), with the grasp of grasp.choose. Nil for an object
-- without a safe window, which any grip holds.
function blind_grips.controller(name, arm, object)
  local close
  if TRIALS[name] then
    close = by_trial(name, arm, object)
  else
    local sample = blind_grips.sample(name, arm.instances, object.name, nil, arm.finger_stiffness)
    local best = blind_grips.best(name, sample)
    close = best
      and function(_, _, contact)
        LAWS[name].close(arm, best.value * object.scale ^ best.size_power, contact, best.power)
      end
  end
  return close
    and function(scene, chosen)
      grasp.approach(arm, object, chosen.width)
      -- States that the hand holds something from here on.
      arm:grasp(arm.closure, { rate = RATE })
      -- What shows of the object is its size: first contact is at the same width as for the nominal instance of that
      -- size.
      local nominal = grasp.window { asset = object.asset, scale = object.scale }
      close(scene, chosen, chosen.is_nominal and nominal.contact or chosen.width)
    end
end

return blind_grips
