-- What layouts have in common: where the arm starts, and things strewn about their places without touching.
local arrange = {}

-- Standard deviation of the arm's joints at the start, rad.
local JOINT = 0.02
-- Half of the hand along its fingers' line and across, with some room, and what it passes over when it grasps low, m.
local PALM, LOW = { 0.108, 0.036 }, 0.05
-- Places that are tried for a thing, arrangements around what is reached for, and places of that before all is given up.
local TRIES, AROUND, PLACES = 60, 40, 20

function arrange.arm(scene, rng)
  local joints, noise = scene.start_q, rng:stream "arm"
  for i = 1, #joints do joints[i] = joints[i] + noise:normal(0, JOINT) end
  scene.start_q = joints
end

-- What an asset covers on its support when it stands at x, y, turned by yaw: half its extents along its own axes.
local function footprint(asset, x, y, yaw)
  local low, high = asset.shape:bounds()
  return {
    x = x, y = y, cos = math.cos(yaw), sin = math.sin(yaw),
    half = { (high[1] - low[1]) / 2, (high[2] - low[2]) / 2 },
  }
end

-- What the palm covers over an asset that is taken across its narrow side.
local function palm(asset, x, y, yaw)
  local own = footprint(asset, x, y, yaw)
  local across = own.half[1] < own.half[2] and yaw or yaw + math.pi / 2
  return { x = x, y = y, cos = math.cos(across), sin = math.sin(across), half = { PALM[1], PALM[2] } }
end

-- How far apart two footprints are at least: the largest gap along the sides of either (separating axes).
local function gap(a, b)
  local dx, dy, most = b.x - a.x, b.y - a.y, -math.huge
  for _, side in ipairs { a, b } do
    for k = 1, 2 do
      local ux, uy = side.cos, side.sin
      if k == 2 then ux, uy = -side.sin, side.cos end
      local reach = 0
      for _, other in ipairs { a, b } do
        reach = reach + other.half[1] * math.abs(ux * other.cos + uy * other.sin)
          + other.half[2] * math.abs(uy * other.cos - ux * other.sin)
      end
      most = math.max(most, math.abs(dx * ux + dy * uy) - reach)
    end
  end
  return most
end

local function draw(rng, thing)
  local reach, turn = thing.reach or 0, thing.turn or 0
  local x = thing.at[1] + rng:uniform(-reach, reach)
  local y = thing.at[2] + rng:uniform(-reach, reach)
  return { x = x, y = y, yaw = (thing.yaw or 0) + rng:uniform(-turn, turn) }
end

-- Whether two things at their places keep their room, and the palm that comes down on either fits past the other.
local function apart(a, b, room)
  if gap(a.print, b.print) < math.max(room, a.thing.room or 0, b.thing.room or 0) then return false end
  return not (a.palm and b.high > LOW and gap(a.palm, b.print) < 0 or b.palm and a.high > LOW and gap(b.palm, a.print) < 0)
end

-- A place of a thing that is apart from all of `others`, or none after some tries.
local function place(rng, thing, others, room)
  for _ = 1, TRIES do
    local at = draw(rng, thing)
    local _, high = thing.asset.shape:bounds()
    local one = {
      thing = thing, at = at, high = high[3], print = footprint(thing.asset, at.x, at.y, at.yaw),
      palm = thing.reachable and palm(thing.asset, at.x, at.y, at.yaw),
    }
    local free = true
    for _, other in ipairs(others) do free = free and apart(one, other, room) end
    if free then return one end
  end
end

-- `others` and behind them those of `things` that are reached for or are not, each apart from all before; none if one finds no place.
local function around(rng, things, others, reachable, room)
  local all = { table.unpack(others) }
  for _, thing in ipairs(things) do
    if (thing.reachable or false) == reachable then
      local one = place(rng, thing, all, room)
      if not one then return nil end
      all[#all + 1] = one
    end
  end
  return all
end

-- Places for `things` ({ name =, asset =, at = { x, y }, yaw =, reach = (m, either way in x and y), turn = (rad), room = (m), reachable = true }),
-- such that all are `room` (m) apart, those with a room of their own that far from all, and a hand can come down on what
-- must be reachable: a list of { x, y, yaw } in the same order. What must be reachable is drawn first and keeps its place while
-- the others are drawn anew: it has all the places that it is given, and not only those that suit the others.
function arrange.scatter(rng, things, room)
  for _ = 1, PLACES do
    local first = around(rng, things, {}, true, room)
    for _ = 1, first and AROUND or 0 do
      local all = around(rng, things, first, false, room)
      if all then
        local places = {}
        for _, one in ipairs(all) do places[one.thing] = one.at end
        for k, thing in ipairs(things) do places[k] = places[thing] end
        return places
      end
    end
  end
  error("arrange.scatter: no arrangement found; give the things more room", 2)
end

-- The same, put into the scene.
function arrange.add(scene, rng, things, room)
  for k, at in ipairs(arrange.scatter(rng, things, room)) do
    scene:add { name = things[k].name, asset = things[k].asset, at = { at.x, at.y }, yaw = at.yaw }
  end
end

return arrange
