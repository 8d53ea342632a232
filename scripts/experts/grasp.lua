-- Grasps from above with a known closure: across the object's narrow side or by its rim, where the hand has clearance.

-- SPREAD: largest displacement of an expert's grasp in each horizontal direction, m, so that demonstrations differ.
-- CONTACT_CLEARANCE: distance of each gel from the object at which closing becomes slow, m. SQUEEZE: what the target
-- width of a rigid object is below its width, m.
local grasp = { SPREAD = 0.0015, CONTACT_CLEARANCE = 0.002, SQUEEZE = 0.012 }

local hand = softvt.hand()
local STROKE, CASE = hand.stroke, hand.case_below
-- Clearance to leave below the cases and around the fingers, m.
local UNDER, FINGER_CLEARANCE = 0.0015, 0.004
-- Step of the rotations tried for clearance.
local STEP = math.rad(7.5)
-- Rate until closing becomes slow, 1/s.
local FAST_RATE = 0.6
-- Width by which a command may exceed that of its grip, m.
local COMMAND_MARGIN = 0.002

-- Maps a yaw to [-90°, 90°]: a two-fingered hand closes along the same line after half a turn.
local function wrap_half_turn(yaw)
  while yaw > math.pi / 2 do
    yaw = yaw - math.pi
  end
  while yaw < -math.pi / 2 do
    yaw = yaw + math.pi
  end
  return yaw
end

-- Yaw of an object's longer horizontal side, rad. The fingers close across it.
function grasp.long_axis_yaw(object) return object.yaw + (object.size[1] < object.size[2] and math.pi / 2 or 0) end

-- Yaw of the hand in a grasp: across the shorter side, or across the rim where it is farthest along x.
function grasp.hand_yaw(object) return object.hints.grasp_rim_m and -math.pi / 2 or grasp.long_axis_yaw(object) end

-- Height of an object's lowest point, m.
function grasp.bottom(object) return object.centre[3] - object.size[3] / 2 end

-- Longer and shorter horizontal side of an object, m.
function grasp.sides(object) return math.max(object.size[1], object.size[2]), math.min(object.size[1], object.size[2]) end

-- A grasp pose across the object's shorter horizontal side. `height` is the height of the tool centre point above the
-- object's lowest point; `offset` (m) and `turn` (rad) displace the grasp, for trials. The hint grasp_offset_m
-- displaces it along the longer side, from the centre towards where most of the mass is.
function grasp.pose(object, height, offset, turn)
  local yaw = grasp.hand_yaw(object) + (turn or 0)
  local x, y = object.centre[1], object.centre[2]
  if offset then
    x, y = x + offset[1], y + offset[2]
  end
  x = x + (object.hints.grasp_rim_m or 0)
  local along, axis = object.hints.grasp_offset_m, grasp.long_axis_yaw(object)
  if along then
    x, y = x + along * math.cos(axis), y + along * math.sin(axis)
  end
  return softvt.pose { position = { x, y, grasp.bottom(object) + height }, yaw = wrap_half_turn(yaw) }
end

-- Height of the tool centre point above an object's lowest point in a grasp: half its height, or the lowest at which
-- the sensor cases clear the support.
function grasp.height(object) return object.hints.grasp_height_m or math.max(CASE + UNDER, object.size[3] / 2) end

-- Width of the object where the fingers grasp it, m.
function grasp.width(object) return object.hints.grasp_width_m or math.min(object.size[1], object.size[2]) end

-- Speed of carrying an object, as a share of the usual one. A long object is carried slowly, so that it does not bend
-- much more than by its weight.
function grasp.carry_pace(object)
  local pace = object.hints and object.hints.carry_pace or 1
  if pace <= 0 or pace > 1 then
    error(("the hint carry_pace of %s: expected a number in 0..1, above 0, got %g"):format(object.name, pace), 0)
  end
  return pace
end

-- The hints of an object that is `factor` times as large: lengths, whose names end in _m, scale with it.
function grasp.scaled_hints(hints, factor)
  local scaled = {}
  for name, value in pairs(hints) do
    scaled[name] = name:sub(-2) == "_m" and factor * value or value
  end
  return scaled
end

-- Why the gripper cannot grasp an object, whatever the pose; nil if it can.
function grasp.problem(object)
  local width = grasp.width(object)
  if width >= STROKE then
    return ("is %.0f mm wide where the fingers grasp it, and the gripper opens %.0f mm"):format(
      1e3 * width,
      1e3 * STROKE
    )
  end
end

-- The safe window of an object (softvt.InstanceWindow), that of its asset scaled to the instance. Nil without a
-- calibration.
function grasp.window(object)
  return softvt.grip_window {
    asset = object.asset,
    scale = object.scale,
    youngs_factor = object.youngs_factor,
    density_factor = object.density_factor,
    strain_factor = object.strain_factor,
    coating = object.coating,
  }
end

-- The grip at a share of the safe window: 0 is the loosest, 1 the tightest. Without a window it is the squeeze of a
-- rigid object, given as a command: its force is 0.
function grasp.target(object, share)
  local window = grasp.window(object)
  if not window then return { width = grasp.width(object) - grasp.SQUEEZE, force = 0 } end
  local function between(key) return window.loose[key] + share * (window.tight[key] - window.loose[key]) end
  return { width = between "width", force = between "force" }
end

-- What the hand lacks for a grip; nil if nothing. The window of a slippery object may ask for such grips. A grip that
-- ends when the pads press has no width.
local function beyond_hand(arm, grip, stop)
  if grip.force > arm.finger_effort then return ("a force of %.0f N on each pad"):format(grip.force) end
  if stop ~= "touch" and (grip.width < 0 or grip.width > STROKE) then
    return ("a width of %.1f mm"):format(1e3 * grip.width)
  end
end

-- Width of the command that holds a grip, m: each finger is a spring, which the force on its pad displaces from its
-- target. Without a stiffness of the drives (N/m), that of the standard hand.
function grasp.command_width(grip, stiffness) return grip.width - 2 * grip.force / (stiffness or hand.finger_stiffness) end

-- The closure of that command.
function grasp.command(grip, stiffness)
  return math.max(0, math.min(1, 1 - grasp.command_width(grip, stiffness) / STROKE))
end

-- The command for the middle of the safe window.
function grasp.closure(object) return grasp.command(grasp.target(object, 0.5)) end

-- The closure at which each gel is `clearance` (m, default 4 mm) away from the object, for approach and release.
-- `width` (m, default that of a nominal grasp) is the distance of the gels at first contact.
function grasp.clear_closure(object, clearance, width)
  local closure = 1 - ((width or grasp.width(object)) + 2 * (clearance or 0.004)) / STROKE
  return math.max(0, math.min(1, closure))
end

-- Rotations of the hand to try, rad: around the shorter side, or all around a square or round object.
local function grasp_rotations(object)
  local list = { 0 }
  local long, short = grasp.sides(object)
  -- A longer box rotated by more would be wider than the gripper opens.
  local most = long < 1.1 * short and math.pi / 2 or math.rad(15)
  for k = 1, math.floor(most / STEP + 1e-9) do
    list[#list + 1], list[#list + 2] = k * STEP, -k * STEP
  end
  return list
end

-- Cost of a rotation: least along or across the object, since the hand grasps the edges of a square object in between.
local function turn_cost(turn)
  local off = math.abs(turn)
  return 0.5 * off + 3 * math.min(off, math.pi / 2 - off)
end

-- Candidate grasps: { pose, is_nominal, cost }. A nominal grasp is where the calibration presses: at the centre, across
-- the shorter side.
local function candidates(object, height, offset)
  local list, hints = {}, object.hints
  if hints.grasp_rim_m then
    local bottom = grasp.bottom(object)
    for k = 0, 47 do
      local angle = k * STEP
      local x = object.centre[1] + hints.grasp_rim_m * math.cos(angle)
      local y = object.centre[2] + hints.grasp_rim_m * math.sin(angle)
      local yaw = wrap_half_turn(angle - math.pi / 2)
      -- The side of the rim that is nearer to the robot is reached with the arm less stretched.
      local stretch = 8 * (x - object.centre[1])
      for _, up in ipairs { 0, 0.003, 0.006 } do
        local pose = softvt.pose { position = { x, y, bottom + height + up }, yaw = yaw }
        list[#list + 1] = { pose = pose, is_nominal = true, cost = math.abs(yaw) + stretch + 300 * up }
      end
    end
  else
    -- Rotated, or off the centre of a long object.
    local long, short = grasp.sides(object)
    local yaw, slack = grasp.long_axis_yaw(object), (long - short) / 4
    for _, along in ipairs { 0, slack, -slack } do
      for _, turn in ipairs(grasp_rotations(object)) do
        local at =
          { (offset and offset[1] or 0) + along * math.cos(yaw), (offset and offset[2] or 0) + along * math.sin(yaw) }
        list[#list + 1] = {
          pose = grasp.pose(object, height, at, turn),
          is_nominal = turn == 0 and along == 0,
          cost = turn_cost(turn) + 100 * math.abs(along),
        }
      end
      if slack < 0.005 then break end
    end
  end
  return list
end

-- Closes fast to a clearance at which nothing is touched. `width` is the distance of the gels at first contact, m. A
-- hand that feels stops up to twice as far away, so that the time of first contact does not reveal the size of the
-- object.
function grasp.approach(arm, object, width)
  local clearance = grasp.CONTACT_CLEARANCE * (arm.feels and 1 + math.random() or 1)
  arm:close_to(math.max(arm.closure, grasp.clear_closure(object, clearance, width)), { rate = FAST_RATE })
end

-- Closes on an object as a person would: fast to a clearance at which nothing is touched, then slowly to the grip.
-- `options`: closing_speed (m/s, of the width), stop ("width": at the measured width of the grip; "touch": when the
-- pads press with its force), closure (a command instead of a grip) and width (distance of the gels at first contact,
-- m).
function grasp.close(arm, object, grip, options)
  local rate = options.closing_speed / STROKE
  grasp.approach(arm, object, options.width)
  if options.closure then return arm:grasp(options.closure, { rate = rate }) end
  local most = grasp.command(grip, arm.finger_stiffness)
  -- A hand that feels finds its own grip.
  if grip.force == 0 or arm.feels then return arm:grasp(most, { rate = rate }) end
  local lack = beyond_hand(arm, grip, options.stop)
  if lack then arm:give_up(("%s needs %s, which the hand does not have"):format(object.name, lack)) end
  -- The command is bounded, in case the object yields or a pad misses it.
  most = math.min(1, most + COMMAND_MARGIN / STROKE)
  if options.stop == "touch" then return arm:grasp(most, { rate = rate, force = grip.force }) end
  arm:grasp(most, { rate = rate, width = grip.width })
end

-- Names of all objects of a scene but one.
local function others_than(object, scene)
  local names = {}
  for _, other in ipairs(scene:objects()) do
    if other.name ~= object.name then names[#names + 1] = other.name end
  end
  return names
end

-- Distance of the gels at first contact in a grasp that is not nominal, m: the open hand can close by its clearance
-- from the object on each side. `others` are the names of the other objects.
local function first_contact(scene, pose, others)
  return STROKE - 2 * math.max(0, (scene:clearance(pose, { width = STROKE, ignore = others })))
end

-- Returns the best grasp: { pose, width, is_nominal, closure, clearance, nearest }. `width` is the distance of the gels
-- at first contact (m), `closure` that of the approach, as open as possible, and `clearance` that of the fingers from
-- the object `nearest` (m), negative if the hand would touch it. No other object may be between the fingers as they
-- close: a finger outside a drawer's front would pull the drawer along.
function grasp.choose(scene, object, height, offset)
  local best
  local others, ignore = others_than(object, scene), object.hints.grasp_rim_m and {} or { object.name }
  for _, candidate in ipairs(candidates(object, height, offset)) do
    local pose, clearance, nearest = candidate.pose, math.huge, nil
    local width = candidate.is_nominal and grasp.width(object) or first_contact(scene, pose, others)
    -- Narrowest opening first: the clearance of a closing motion is that of its narrowest point.
    local openings = { grasp.clear_closure(object, 0.005, width), grasp.clear_closure(object, 0.010, width), 0 }
    for _, opening in ipairs(openings) do
      local distance, name = scene:clearance(pose, { width = STROKE * (1 - opening), ignore = ignore })
      if distance < clearance then
        clearance, nearest = distance, name
      end
      -- Clearance beyond the required one has no value.
      local score = math.min(clearance, FINGER_CLEARANCE) * 1e3 - 0.1 * candidate.cost - opening
      if not best or score > best.score then
        best = {
          pose = pose,
          width = width,
          is_nominal = candidate.is_nominal,
          closure = opening,
          clearance = clearance,
          nearest = nearest,
          score = score,
        }
      end
    end
  end
  return best
end

return grasp
