-- Joints of articulated objects, world frame: names like "cabinet.top_drawer".
local frames = require "experts.frames"

local mechanism = {}

-- Returns the articulated object and the part of a joint's name, or gives up.
function mechanism.find(arm, scene, joint)
  local object_name, part_name = joint:match "^(.-)%.(.+)$"
  if not object_name then arm:give_up(('the joint "%s" is not named like "cabinet.top_drawer"'):format(joint)) end
  return scene:object(object_name), scene:part(object_name, part_name)
end

-- Axis of the joint along or about which its value grows, a unit vector.
function mechanism.axis(object, part)
  -- Both articulated assets have joints along -y of the object.
  return { math.sin(object.yaw), -math.cos(object.yaw), 0 }
end

-- Limits of the joint, m or rad.
function mechanism.range(part) return part.asset:find "knob" and { 0, 1.5 * math.pi } or { 0, 0.15 } end

-- The joint's value at a share of its range.
function mechanism.value(part, share)
  local range = mechanism.range(part)
  return range[1] + share * (range[2] - range[1])
end

return mechanism
