-- Joints of articulated objects, world frame: names like "cabinet.top_drawer".
local mechanism = {}

-- Returns the articulated object and the part of a joint's name, or gives up.
function mechanism.find(arm, scene, joint)
  local object_name, part_name = joint:match "^(.-)%.(.+)$"
  if not object_name then arm:give_up(('the joint "%s" is not named like "cabinet.top_drawer"'):format(joint)) end
  return scene:object(object_name), scene:part(object_name, part_name)
end

-- The joint's value at a share of its range.
function mechanism.value(part, share)
  local lower, upper = table.unpack(part.joint_range)
  return lower + share * (upper - lower)
end

return mechanism
