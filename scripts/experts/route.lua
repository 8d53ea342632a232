-- Ways through the air over what stands on them.
local route = {}

-- The hand reaches this far beyond the tool centre point, along its fingers' line and below, m.
local HAND, CASE = 0.07, 0.016

-- Distance of a point from the line between two others, in the plane.
local function from_line(p, a, b)
  local dx, dy = b[1] - a[1], b[2] - a[2]
  local length2 = dx * dx + dy * dy
  local share = length2 > 0 and ((p[1] - a[1]) * dx + (p[2] - a[2]) * dy) / length2 or 0
  share = math.max(0, math.min(1, share))
  return math.sqrt((p[1] - a[1] - share * dx) ^ 2 + (p[2] - a[2] - share * dy) ^ 2)
end

-- How far an object reaches from its middle, m: what is taken by its rim is round.
local function radius_of(object)
  if object.hints.grasp_rim_m then return math.max(object.size[1], object.size[2]) / 2 end
  return math.sqrt(object.size[1] ^ 2 + object.size[2] ^ 2) / 2
end

-- Height of the tool centre point at which the hand, and what it holds ({ object =, below = m under it }), passes over
-- everything between two points by `margin` (m).
function route.height(scene, from, to, carried, margin)
  local name, reach = carried.object.name, math.max(HAND, radius_of(carried.object))
  local top = 0
  for _, object in ipairs(scene:objects()) do
    local radius = radius_of(object)
    -- What reaches under the whole way is the support, or scenery.
    if object.name ~= name and radius < 0.5 and from_line(object.xyz, from, to) < reach + radius then
      top = math.max(top, object.xyz[3] + object.size[3] / 2)
    end
  end
  return top + math.max(CASE, carried.below) + margin
end

-- The least height of the tool centre point, from that of `pose` and `rise` (m) on, at which the empty hand comes to over
-- `pose` from `from` with `margin` (m) to everything; where there is none, the one with the most room.
function route.over(scene, from, pose, rise, margin)
  local best
  for step = 0, 8 do
    local z, room = pose.z + rise + 0.015 * step, math.huge
    for k = 1, 8 do
      local share = k / 8
      local x, y = from[1] + share * (pose.x - from[1]), from[2] + share * (pose.y - from[2])
      room = math.min(room, (scene:clearance(pose:at { x, y, z })))
    end
    if room >= margin then return z end
    if not best or room > best.room then best = { z = z, room = room } end
  end
  return best.z
end

return route
