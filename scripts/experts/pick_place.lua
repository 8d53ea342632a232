-- Picks an object up and puts it down on (or into) another: approach, grasp, lift, carry, place, let go, retreat.
--
--   expert = pick_place { object = "left", target = "plate" }
local grasp = require "experts.grasp"
local route = require "experts.route"

local FIELDS = { object = true, target = true, closure = true, speed = true }
-- Clearance over everything while carrying, over the target when letting go, and beside the fingers there, m.
local OVER, DROP, BESIDE = 0.025, 0.001, 0.002
-- An object that has not come along by this much of a lift is not held.
local HELD = 0.5
-- Attempts at taking hold, and how far the object may have moved before one, m.
local TRIES, AWAY = 3, 0.08
-- Spread of speeds, and of the grasp along the fingers' line and across it, so that no two demonstrations are alike.
local PACE, MISS = 0.12, 0.0015

local function checked(spec)
  for key in pairs(spec) do
    if not FIELDS[key] then error("pick_place: unknown field " .. tostring(key), 3) end
  end
  if type(spec.object) ~= "string" or type(spec.target) ~= "string" then
    error("pick_place: object and target must name objects of the scene", 3)
  end
  return spec
end

local function spread(most) return (2 * math.random() - 1) * most end

-- Takes the object and lifts it off what it stands on; whether it came along, and how high it was held or why not.
local function take(arm, scene, spec, pace)
  local object = scene:object(spec.object)
  local height = grasp.height(object)
  local at, opening, room = grasp.choose(scene, object, height, { spread(MISS), spread(MISS) })
  if room < 0 then return false, "has no room beside it for the hand" end
  local over = route.over(scene, arm.pose.xyz, at, 0.05, BESIDE)
  arm:move_to(arm.target:at { arm.target.x, arm.target.y, math.max(over, arm.target.z) }, { speed = 0.4 * pace })
  arm:move_to(at:at { at.x, at.y, over }, { speed = 0.4 * pace, closure = opening })
  arm:move_to(at, { speed = 0.25 * pace, closure = opening })
  arm:wait(0.1)
  local before = scene:object(spec.object).xyz[3]
  arm:grasp(spec.closure or grasp.closure(object), { rate = 0.6 })
  arm:wait(0.3)
  -- Straight up before going anywhere.
  arm:move_by({ 0, 0, 0.05 }, { speed = 0.2 * pace })
  if scene:object(spec.object).xyz[3] - before > HELD * 0.05 then return true, height end
  return false, "did not come along when it was lifted"
end

-- Turns of the hand for putting down, the nearest first.
local function turns(object, target)
  local list = { 0 }
  for k = 1, 6 do list[#list + 1], list[#list + 2] = k * math.rad(15), -k * math.rad(15) end
  -- What is long goes along the longer side of what it is put into.
  local long, short = grasp.sides(object)
  if target.hints.wall_m and long > 1.3 * short then
    local turn = (grasp.lie(target) - grasp.lie(object)) % math.pi
    table.insert(list, 1, turn > math.pi / 2 and turn - math.pi or turn)
  end
  return list
end

-- Where to let go: as low as the hand has room for, the object over the middle of the target.
local function resting_pose(arm, scene, spec, height)
  local object, target = scene:object(spec.object), scene:object(spec.target)
  local surface = grasp.bottom(target) + (target.hints.surface_m or target.size[3]) + height + DROP
  local width = 0.08 * (1 - grasp.clear(object))
  -- The object may hang off the tool's axis; that offset turns with the hand.
  local dx, dy = object.xyz[1] - arm.pose.x, object.xyz[2] - arm.pose.y
  local best, ways = nil, turns(object, target)
  for up = 0, 20 do
    for _, turn in ipairs(ways) do
      local c, s = math.cos(turn), math.sin(turn)
      local x, y = target.xyz[1] - (c * dx - s * dy), target.xyz[2] - (s * dx + c * dy)
      local pose = arm.target:turned(turn):at { x, y, surface + 0.005 * up }
      local room = scene:clearance(pose, { width = width, ignore = { spec.object } })
      if not best or room > best.room then best = { pose = pose, room = room } end
      if room >= BESIDE then return pose end
    end
  end
  return best.pose
end

local function put(arm, scene, spec, height, pace)
  local object = scene:object(spec.object)
  local place = resting_pose(arm, scene, spec, height)
  local carried = { object = object, below = height }
  local over = math.max(place.z + 0.03, route.height(scene, arm.pose.xyz, place.xyz, carried, OVER))
  arm:move_to(arm.target:at { arm.target.x, arm.target.y, math.max(over, arm.target.z) }, { speed = 0.25 * pace })
  arm:move_to(place:at { place.x, place.y, over }, { speed = 0.4 * pace })
  arm:move_to(place, { speed = 0.2 * pace })
  arm:wait(0.2)
  -- Only as wide as needed: a rim or a wall may be near.
  arm:release { closure = grasp.clear(object), rate = 0.4 }
  arm:wait(0.1)
  arm:move_by({ 0, 0, math.max(0.08, over - place.z) }, { speed = 0.25 * pace })
end

return function(spec)
  checked(spec)
  return function(arm, scene)
    local pace = (spec.speed or 1) * (1 + spread(PACE))
    local first, reason = scene:object(spec.object).xyz, nil
    for _ = 1, TRIES do
      -- What has slid or rolled away is not chased.
      local now = scene:object(spec.object).xyz
      local moved = math.sqrt((now[1] - first[1]) ^ 2 + (now[2] - first[2]) ^ 2)
      if moved > AWAY then arm:give_up(("%s is %.0f mm from where it was; it is not chased"):format(spec.object, 1e3 * moved)) end
      local held, result = take(arm, scene, spec, pace)
      if held then return put(arm, scene, spec, result, pace) end
      reason = result
      -- Not forced: let go, rise, look again.
      arm:open()
      arm:move_by({ 0, 0, 0.03 }, { speed = 0.25 })
    end
    arm:give_up(("%s %s, %d times"):format(spec.object, reason, TRIES))
  end
end
