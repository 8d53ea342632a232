-- Helpers of layouts: random start of the arm, and random placement of objects without contact.
local arrange = {}

-- Standard deviation of the arm's initial joint angles, rad.
local JOINT = 0.02
-- Half extents of the hand along and across the closing direction, with a margin, and the height that it passes above
-- when it grasps low, m.
local PALM, LOW = { 0.108, 0.036 }, 0.05
-- Distance from the origin beyond which no object of a scene lies, m.
local FAR = 3
-- Draws per object, draws of the other objects per placement of the graspable ones, and placements before an error.
local DRAWS, REDRAWS, PLACEMENTS = 60, 40, 20

local FIELDS = {
  name = "string",
  asset = "table",
  at = "table",
  yaw = "number?",
  position_range = "number?",
  yaw_range = "number?",
  clearance = "number?",
  reachable = "boolean?",
}

-- Checks the arguments of the function `name` of this file; errors are at the line that called it.
local function check(name, arguments, types)
  softvt.check_fields(name, arguments, types)
  if arguments.clearance < 0 then
    error(("%s: clearance: expected metres of 0 or more, got %g"):format(name, arguments.clearance), 3)
  end
  local function wrong(k, key, message) error(("%s: objects[%d].%s: %s"):format(name, k, key, message), 4) end
  for k, object in ipairs(arguments.objects) do
    softvt.check_fields(("%s: objects[%d]"):format(name, k), object, FIELDS)
    if #object.at ~= 2 then wrong(k, "at", "expected a list of 2 numbers, x and y") end
    for i = 1, 2 do
      local at = object.at[i]
      if type(at) ~= "number" then wrong(k, "at", "expected a list of 2 numbers, x and y") end
      if math.abs(at) > FAR then
        wrong(k, "at", ("(%g, %g) m is out of the scene; lengths are in metres"):format(at, object.at[2]))
      end
    end
    for _, key in ipairs { "yaw", "yaw_range" } do
      if math.abs(object[key] or 0) > 2 * math.pi then
        wrong(k, key, ("expected radians up to a full turn, got %g; math.rad converts degrees"):format(object[key]))
      end
    end
    for _, key in ipairs { "position_range", "yaw_range", "clearance" } do
      if (object[key] or 0) < 0 then wrong(k, key, ("expected a number of 0 or more, got %g"):format(object[key])) end
    end
  end
end

-- Adds normal noise to the arm's initial joint angles.
function arrange.arm(scene, rng, surplus)
  if surplus ~= nil then error("arrange.arm: expected the scene and the layout's random numbers alone", 2) end
  if rng == nil then error("arrange.arm: expected the layout's random numbers as the second argument: arrange.arm(scene, rng)", 2) end
  local joints, noise = scene.start_q, rng:stream "arm"
  for i = 1, #joints do
    joints[i] = joints[i] + noise:normal(0, JOINT)
  end
  scene.start_q = joints
end

-- Footprint of an asset at x, y with a yaw: an oriented rectangle with half extents along its own axes.
local function footprint(asset, x, y, yaw)
  local low, high = asset.shape:bounds()
  return {
    x = x,
    y = y,
    cos = math.cos(yaw),
    sin = math.sin(yaw),
    half = { (high[1] - low[1]) / 2, (high[2] - low[2]) / 2 },
  }
end

-- Footprint of the hand above an asset grasped across its narrow side.
local function hand_footprint(asset, x, y, yaw)
  local own = footprint(asset, x, y, yaw)
  local across = own.half[1] < own.half[2] and yaw or yaw + math.pi / 2
  return { x = x, y = y, cos = math.cos(across), sin = math.sin(across), half = { PALM[1], PALM[2] } }
end

-- Lower bound of the distance between two footprints: the largest gap along a side of either (separating axes).
local function gap(a, b)
  local dx, dy, most = b.x - a.x, b.y - a.y, -math.huge
  for _, side in ipairs { a, b } do
    for k = 1, 2 do
      local ux, uy = side.cos, side.sin
      if k == 2 then
        ux, uy = -side.sin, side.cos
      end
      local reach = 0
      for _, other in ipairs { a, b } do
        reach = reach
          + other.half[1] * math.abs(ux * other.cos + uy * other.sin)
          + other.half[2] * math.abs(uy * other.cos - ux * other.sin)
      end
      most = math.max(most, math.abs(dx * ux + dy * uy) - reach)
    end
  end
  return most
end

local function draw(rng, object)
  local reach, turn = object.position_range or 0, object.yaw_range or 0
  local x = object.at[1] + rng:uniform(-reach, reach)
  local y = object.at[2] + rng:uniform(-reach, reach)
  return { x = x, y = y, yaw = (object.yaw or 0) + rng:uniform(-turn, turn) }
end

-- True if two placed objects keep their clearance, and a hand above either fits past the other.
local function apart(a, b, clearance)
  if gap(a.print, b.print) < math.max(clearance, a.object.clearance or 0, b.object.clearance or 0) then return false end
  return not (
    a.hand and b.high > LOW and gap(a.hand, b.print) < 0 or b.hand and a.high > LOW and gap(b.hand, a.print) < 0
  )
end

-- Draws a placement of an object that is apart from all of `others`; nil if no draw succeeds.
local function place(rng, object, others, clearance)
  for _ = 1, DRAWS do
    local at = draw(rng, object)
    local _, high = object.asset.shape:bounds()
    local one = {
      object = object,
      at = at,
      high = high[3],
      print = footprint(object.asset, at.x, at.y, at.yaw),
      hand = object.reachable and hand_footprint(object.asset, at.x, at.y, at.yaw),
    }
    local free = true
    for _, other in ipairs(others) do
      free = free and apart(one, other, clearance)
    end
    if free then return one end
  end
end

-- Returns `others` followed by placements of those objects whose `reachable` equals the argument, each apart from all
-- before; nil if an object finds no placement.
local function place_all(rng, objects, others, reachable, clearance)
  local all = { table.unpack(others) }
  for _, object in ipairs(objects) do
    if (object.reachable or false) == reachable then
      local one = place(rng, object, all, clearance)
      if not one then return nil end
      all[#all + 1] = one
    end
  end
  return all
end

-- See arrange.scatter; the function `name` has checked the arguments.
local function scatter(name, rng, objects, clearance)
  for _ = 1, PLACEMENTS do
    local first = place_all(rng, objects, {}, true, clearance)
    for _ = 1, first and REDRAWS or 0 do
      local all = place_all(rng, objects, first, false, clearance)
      if all then
        local places = {}
        for _, one in ipairs(all) do
          places[one.object] = one.at
        end
        for k, object in ipairs(objects) do
          places[k] = places[object]
        end
        return places
      end
    end
  end
  error(
    name .. ": no arrangement found; place the objects further apart, or give smaller ones (lengths are in metres)",
    3
  )
end

-- Draws positions of `objects` and returns a list of { x, y, yaw } in the same order. Each object is a table:
--
--   name, asset, at = { x, y } (m), yaw (rad)
--   position_range   largest displacement in x and y, in either direction, m
--   yaw_range        largest rotation in either direction, rad
--   clearance        distance to all other objects, m; at least the argument `clearance`
--   reachable        true if a hand must be able to grasp it from above
--
-- Reachable objects are drawn first and keep their positions while the others are redrawn. Their distribution therefore
-- does not depend on the other objects.
function arrange.scatter(rng, objects, clearance, surplus)
  if surplus ~= nil then error("arrange.scatter: expected rng, objects and clearance alone", 2) end
  check(
    "arrange.scatter",
    { rng = rng, objects = objects, clearance = clearance },
    { rng = "userdata", objects = "table", clearance = "number" }
  )
  -- No tail call: the level of errors counts this function.
  local places = scatter("arrange.scatter", rng, objects, clearance)
  return places
end

-- Draws positions as arrange.scatter does and adds the objects to the scene.
function arrange.add(scene, rng, objects, clearance, surplus)
  if surplus ~= nil then error("arrange.add: expected scene, rng, objects and clearance alone", 2) end
  check(
    "arrange.add",
    { scene = scene, rng = rng, objects = objects, clearance = clearance },
    { scene = "userdata", rng = "userdata", objects = "table", clearance = "number" }
  )
  for k, at in ipairs(scatter("arrange.add", rng, objects, clearance)) do
    scene:add {
      name = objects[k].name,
      asset = objects[k].asset,
      at = { at.x, at.y },
      yaw = math.fmod(at.yaw, 2 * math.pi),
    }
  end
end

return arrange
