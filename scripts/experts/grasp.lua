-- How to take hold of an object that lies on something: across its narrow side, from above, with a known closure.
local calibrated = require "calibrated"

local grasp = {}

-- The sensors' cases reach 16 mm below the tool centre point; this leaves room over the table and over a plate's rim.
local LOWEST = 0.0225
-- Full stroke of the gripper, m.
local STROKE = 0.08

-- The nearest of the two turns of a two-fingered hand that close along the same line.
local function nearest(yaw)
  while yaw > math.pi / 2 do yaw = yaw - math.pi end
  while yaw < -math.pi / 2 do yaw = yaw + math.pi end
  return yaw
end

-- A pose over an object: fingers across its shorter horizontal side. `height` is that of the tool centre point over the
-- object's lowest point; `offset` (m) and `turn` (rad) displace the grasp on purpose, for trials.
function grasp.pose(object, height, offset, turn)
  local yaw = object.yaw + (object.size[1] < object.size[2] and math.pi / 2 or 0) + (turn or 0)
  local x, y = object.xyz[1], object.xyz[2]
  if offset then x, y = x + offset[1], y + offset[2] end
  local bottom = object.xyz[3] - object.size[3] / 2
  return softvt.pose { xyz = { x, y, bottom + height }, yaw = nearest(yaw) }
end

-- Height of the tool centre point over an object's lowest point when it grasps: half way up, or as low as cases allow.
function grasp.height(object)
  return object.hints.grasp_height_m or math.max(LOWEST, object.size[3] / 2)
end

-- The width across which the fingers close, m.
function grasp.width(object) return math.min(object.size[1], object.size[2]) end

-- How far to close: between what just holds and what deforms too much; without a calibration, a tenth of the width.
function grasp.closure(object)
  local known = calibrated[object.asset]
  if known then return known.lower + 0.5 * (known.at_tau - known.lower) end
  return 1 - 0.9 * grasp.width(object) / STROKE
end

-- The closure at which the gels are 4 mm away from the object on either side, to approach and to let go.
function grasp.clear(object)
  return math.max(0, 1 - (grasp.width(object) + 0.008) / STROKE)
end

return grasp
