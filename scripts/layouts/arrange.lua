-- What layouts have in common: where the arm starts, and things strewn about their places without touching.
local arrange = {}

-- Standard deviation of the arm's joints at the start, rad.
local JOINT = 0.02
-- Half of the hand along its fingers' line and across, with some room, and what it passes over when it grasps low, m.
local PALM, LOW = { 0.108, 0.036 }, 0.05
-- Tries before an arrangement is given up.
local TRIES = 1000

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

local function draw(rng, things)
  local placed = {}
  for k, thing in ipairs(things) do
    local reach, turn = thing.reach or 0, thing.turn or 0
    local x = thing.at[1] + rng:uniform(-reach, reach)
    local y = thing.at[2] + rng:uniform(-reach, reach)
    placed[k] = { x = x, y = y, yaw = (thing.yaw or 0) + rng:uniform(-turn, turn) }
  end
  return placed
end

-- Whether all keep their room, and the palm fits between those that stand higher than it would.
local function apart(things, placed, room)
  local prints = {}
  for k, thing in ipairs(things) do
    prints[k] = footprint(thing.asset, placed[k].x, placed[k].y, placed[k].yaw)
    for other = 1, k - 1 do
      if gap(prints[k], prints[other]) < math.max(room, things[k].room or 0, things[other].room or 0) then return false end
    end
  end
  for k, thing in ipairs(things) do
    local over = thing.reachable and palm(thing.asset, placed[k].x, placed[k].y, placed[k].yaw)
    for other = 1, over and #things or 0 do
      local _, high = things[other].asset.shape:bounds()
      if other ~= k and high[3] > LOW and gap(over, prints[other]) < 0 then return false end
    end
  end
  return true
end

-- Places for `things` ({ name =, asset =, at = { x, y }, yaw =, reach = (m, either way in x and y), turn = (rad), room = (m), reachable = true }),
-- drawn anew until all are `room` (m) apart, and those with a room of their own that far from all, and a hand can come
-- down on what must be reachable: a list of { x, y, yaw } in the same order.
function arrange.scatter(rng, things, room)
  for _ = 1, TRIES do
    local placed = draw(rng, things)
    if apart(things, placed, room) then return placed end
  end
  error(("arrange.scatter: no arrangement found in %d tries; give the things more room"):format(TRIES), 2)
end

-- The same, put into the scene.
function arrange.add(scene, rng, things, room)
  for k, place in ipairs(arrange.scatter(rng, things, room)) do
    scene:add { name = things[k].name, asset = things[k].asset, at = { place.x, place.y }, yaw = place.yaw }
  end
end

return arrange
