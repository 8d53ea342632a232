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

-- Height of the tool centre point at which the hand, and what it holds `below` (m) beneath it and `reach` (m) to its
-- sides, passes over everything between two points by `margin` (m).
function route.height(scene, from, to, carried, margin)
  local reach, below = HAND, CASE
  local held
  if carried then
    held = carried.object.name
    reach = math.max(HAND, math.sqrt(carried.object.size[1] ^ 2 + carried.object.size[2] ^ 2) / 2)
    below = math.max(CASE, carried.below)
  end
  local top = 0
  for _, object in ipairs(scene:objects()) do
    local radius = math.sqrt(object.size[1] ^ 2 + object.size[2] ^ 2) / 2
    -- What reaches under the whole way is the support, or scenery.
    if object.name ~= held and radius < 0.5 and from_line(object.xyz, from, to) < reach + radius then
      top = math.max(top, object.xyz[3] + object.size[3] / 2)
    end
  end
  return top + below + margin
end

return route
