-- Places near an object, as seen from the robot, which looks along x.
local frames = require "experts.frames"

local places = {}

local DIRECTIONS = {
  left_of = { 0, 1, 0 },
  right_of = { 0, -1, 0 },
  in_front_of = { -1, 0, 0 },
  behind = { 1, 0, 0 },
}
-- Largest distance of two centres, m.
local MAX_DISTANCE = 1
-- Space between an object and its neighbour where no distance is given, m.
local SPACE = 0.015

-- State of an object, or of a part such as "cabinet.top_drawer".
function places.state(scene, name)
  local object, part = name:match "^(.-)%.(.+)$"
  if object then return scene:part(object, part) end
  return scene:object(name)
end

-- Half extent of an object along a horizontal direction, m.
function places.half_extent(object, direction)
  if object.hints.grasp_rim_m then return math.max(object.size[1], object.size[2]) / 2 end
  local c, s = math.cos(object.yaw), math.sin(object.yaw)
  local x, y = c * direction[1] + s * direction[2], c * direction[2] - s * direction[1]
  return (math.abs(x) * object.size[1] + math.abs(y) * object.size[2]) / 2
end

-- Raises an error of the expert `name` if the fields `to`, `distance` and `target` of a specification are not a place
-- near another object; `level` is that of error.
function places.check(name, spec, level)
  if spec.target == spec.object then
    error(('%s: target: is "%s", the object itself; name another'):format(name, spec.target), level)
  end
  if spec.to and spec.to ~= "near" and not DIRECTIONS[spec.to] then
    error(
      ('%s: to: expected "near", "left_of", "right_of", "in_front_of" or "behind", got "%s"'):format(name, spec.to),
      level
    )
  end
  if spec.distance and not (spec.distance > 0 and spec.distance <= MAX_DISTANCE) then
    local expected = ("metres in 0..%g, above 0"):format(MAX_DISTANCE)
    error(("%s: distance: expected %s, got %g"):format(name, expected, spec.distance), level)
  end
end

-- Centre of spec.object at its place near spec.target, at the present height, or nil and the reason. `spec.to` is
-- "near", on the line between the two, or a direction; `spec.distance` (m) is that between the centres.
function places.beside(scene, spec)
  local object, target = scene:object(spec.object), places.state(scene, spec.target)
  local direction = DIRECTIONS[spec.to]
  if not direction then
    direction = { object.centre[1] - target.centre[1], object.centre[2] - target.centre[2], 0 }
    if frames.dot(direction, direction) < 1e-6 then
      return nil, ("%s is at the centre of %s"):format(spec.object, spec.target)
    end
    direction = frames.unit(direction)
  end
  local distance = spec.distance
    or places.half_extent(object, direction) + places.half_extent(target, direction) + SPACE
  local place = frames.add(target.centre, direction, distance)
  return { place[1], place[2], object.centre[3] }
end

return places
