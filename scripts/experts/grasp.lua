-- How to take hold of an object from above, with a known closure: across its narrow side, or by its rim, wherever the hand
-- has room among its neighbours.
local calibrated = require "calibrated"

local grasp = {}

-- Full stroke of the gripper, m.
local STROKE = 0.08
-- The sensors' cases reach this far below the tool centre point, m.
local CASE = 0.016
-- Room to leave under the cases and beside the fingers, m.
local UNDER, BESIDE = 0.0015, 0.004
-- Turns away from the best line that are tried for room: steps of 7.5°.
local STEP = math.rad(7.5)
-- How much a gripper squeezes what is rigid, m of width that its fingers would still close.
local SQUEEZE = 0.012

-- The nearest of the two turns of a two-fingered hand that close along the same line.
local function nearest(yaw)
  while yaw > math.pi / 2 do yaw = yaw - math.pi end
  while yaw < -math.pi / 2 do yaw = yaw + math.pi end
  return yaw
end

-- The direction of an object's longer horizontal side, rad: the fingers close across it.
function grasp.lie(object) return object.yaw + (object.size[1] < object.size[2] and math.pi / 2 or 0) end

-- Height of an object's lowest point, m.
function grasp.bottom(object) return object.xyz[3] - object.size[3] / 2 end

-- An object's longer and shorter horizontal side, m.
function grasp.sides(object)
  return math.max(object.size[1], object.size[2]), math.min(object.size[1], object.size[2])
end

-- A pose over an object: fingers across its shorter horizontal side. `height` is that of the tool centre point over the
-- object's lowest point; `offset` (m) and `turn` (rad) displace the grasp on purpose, for trials.
function grasp.pose(object, height, offset, turn)
  local yaw = grasp.lie(object) + (turn or 0)
  local x, y = object.xyz[1], object.xyz[2]
  if offset then x, y = x + offset[1], y + offset[2] end
  return softvt.pose { xyz = { x, y, grasp.bottom(object) + height }, yaw = nearest(yaw) }
end

-- Height of the tool centre point over an object's lowest point when it grasps: half way up, or as low as cases allow on
-- what the object stands on.
function grasp.height(object)
  return object.hints.grasp_height_m or math.max(CASE + UNDER, object.size[3] / 2)
end

-- The width across which the fingers close, m, where they take it.
function grasp.width(object)
  return object.hints.grasp_width_m or math.min(object.size[1], object.size[2])
end

-- How far to close: between what just holds and what deforms too much; without a calibration, a squeeze of what is rigid.
function grasp.closure(object)
  local known = calibrated[object.asset]
  if known then return known.lower + 0.5 * (known.at_tau - known.lower) end
  local width = grasp.width(object)
  if width >= STROKE then
    error(("pick_place: %s is %.0f mm wide where the fingers take it; the hand opens 80 mm"):format(object.name, 1e3 * width), 0)
  end
  return math.min(1, 1 - (width - SQUEEZE) / STROKE)
end

-- The closure at which the gels are `room` (m, 4 mm) away from the object on either side, to approach and to let go.
function grasp.clear(object, room)
  return math.max(0, 1 - (grasp.width(object) + 2 * (room or 0.004)) / STROKE)
end

-- Turns of the hand to try, the best first: about the narrow side, or all around what is round.
local function turns(object)
  local list = { 0 }
  local long, short = grasp.sides(object)
  -- Turned by more than this, a box would be wider than the fingers open.
  local most = long < 1.1 * short and math.pi / 2 or math.rad(15)
  for k = 1, math.floor(most / STEP + 1e-9) do
    list[#list + 1], list[#list + 2] = k * STEP, -k * STEP
  end
  return list
end

-- Poses in which the object could be taken, the best first: { pose, cost }.
local function candidates(object, height, offset)
  local list, hints = {}, object.hints
  if hints.grasp_rim_m then
    local bottom = grasp.bottom(object)
    for k = 0, 47 do
      local angle = k * STEP
      local x = object.xyz[1] + hints.grasp_rim_m * math.cos(angle)
      local y = object.xyz[2] + hints.grasp_rim_m * math.sin(angle)
      local yaw = nearest(angle - math.pi / 2)
      -- The side of the rim that is nearer to the robot is reached with the arm less stretched.
      local stretch = 8 * (x - object.xyz[1])
      for _, up in ipairs { 0, 0.003, 0.006 } do
        list[#list + 1] = { softvt.pose { xyz = { x, y, bottom + height + up }, yaw = yaw }, math.abs(yaw) + stretch + 300 * up }
      end
    end
  else
    -- Turned, or beside the middle of what is long.
    local long, short = grasp.sides(object)
    local yaw, slack = grasp.lie(object), (long - short) / 4
    for _, along in ipairs { 0, slack, -slack } do
      for _, turn in ipairs(turns(object)) do
        local at = { (offset and offset[1] or 0) + along * math.cos(yaw), (offset and offset[2] or 0) + along * math.sin(yaw) }
        list[#list + 1] = { grasp.pose(object, height, at, turn), 2 * math.abs(turn) + 100 * math.abs(along) }
      end
      if slack < 0.005 then break end
    end
  end
  return list
end

-- The pose to take an object in and the closure to come down with: where the fingers have room, as wide open as it goes.
-- The third result is the room that they have, m; negative if the hand would touch something. Nothing else may be between the
-- fingers as they close: a finger outside of a drawer's front would take that along.
function grasp.choose(scene, object, height, offset)
  local best
  local ignore = object.hints.grasp_rim_m and {} or { object.name }
  -- The tightest first: the way that is still to close has the room of the tightest place on it.
  local openings = { grasp.clear(object, 0.005), grasp.clear(object, 0.010), 0 }
  for _, candidate in ipairs(candidates(object, height, offset)) do
    local pose, cost = candidate[1], candidate[2]
    local room = math.huge
    for _, opening in ipairs(openings) do
      room = math.min(room, (scene:clearance(pose, { width = STROKE * (1 - opening), ignore = ignore })))
      -- Room beyond what is needed is worth nothing.
      local worth = math.min(room, BESIDE) * 1e3 - 0.1 * cost - opening
      if not best or worth > best.worth then best = { pose = pose, closure = opening, room = room, worth = worth } end
    end
  end
  return best.pose, best.closure, best.room
end

return grasp
