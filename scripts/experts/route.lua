-- Heights at which the hand passes above obstacles.
local hand = softvt.hand()

local route = {}

-- Extent of the hand beyond the tool centre point along the closing direction, m.
local HAND = 0.07

-- Horizontal distance of a point from the segment between two others.
local function segment_distance(p, a, b)
  local dx, dy = b[1] - a[1], b[2] - a[2]
  local length2 = dx * dx + dy * dy
  local t = length2 > 0 and ((p[1] - a[1]) * dx + (p[2] - a[2]) * dy) / length2 or 0
  t = math.max(0, math.min(1, t))
  return math.sqrt((p[1] - a[1] - t * dx) ^ 2 + (p[2] - a[2] - t * dy) ^ 2)
end

-- Horizontal radius of an object, m. Objects grasped by their rim are round.
local function radius_of(object)
  if object.hints.grasp_rim_m then return math.max(object.size[1], object.size[2]) / 2 end
  return math.sqrt(object.size[1] ^ 2 + object.size[2] ^ 2) / 2
end

-- Returns the height of the tool centre point at which the hand and a carried object pass above everything between two
-- points by `margin` (m). `carried` is { object =, below = (m that it extends below the tool) }.
function route.carry_height(scene, from, to, carried, margin)
  local name, reach = carried.object.name, math.max(HAND, radius_of(carried.object))
  local top = 0
  for _, object in ipairs(scene:objects()) do
    local radius = radius_of(object)
    -- A larger object is the support or scenery.
    if object.name ~= name and radius < 0.5 and segment_distance(object.centre, from, to) < reach + radius then
      top = math.max(top, object.centre[3] + object.size[3] / 2)
    end
  end
  return top + math.max(hand.case_below, carried.below) + margin
end

-- Returns the lowest height of the tool centre point, at least `rise` (m) above `pose`, at which the empty hand moves
-- from `from` to above `pose` with `margin` (m) of clearance, or else the height with the largest clearance.
function route.approach_height(scene, from, pose, rise, margin)
  local best
  for step = 0, 8 do
    local z, clearance = pose.z + rise + 0.015 * step, math.huge
    for k = 1, 8 do
      local t = k / 8
      local x, y = from[1] + t * (pose.x - from[1]), from[2] + t * (pose.y - from[2])
      clearance = math.min(clearance, (scene:clearance(pose:at { x, y, z })))
    end
    if clearance >= margin then return z end
    if not best or clearance > best.clearance then best = { z = z, clearance = clearance } end
  end
  return best.z
end

return route
