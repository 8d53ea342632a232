-- Vectors and orientations of the hand, world frame.
local frames = {}

function frames.add(a, b, factor)
  factor = factor or 1
  return { a[1] + factor * b[1], a[2] + factor * b[2], a[3] + factor * b[3] }
end

function frames.dot(a, b) return a[1] * b[1] + a[2] * b[2] + a[3] * b[3] end

function frames.cross(a, b) return { a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1] } end

function frames.scaled(a, factor) return { factor * a[1], factor * a[2], factor * a[3] } end

function frames.unit(a) return frames.scaled(a, 1 / math.sqrt(frames.dot(a, a))) end

-- Rotates a vector about a unit axis by an angle (Rodrigues).
function frames.rotated(v, axis, angle)
  local c, s = math.cos(angle), math.sin(angle)
  local along = frames.scaled(axis, (1 - c) * frames.dot(axis, v))
  return frames.add(frames.add(frames.scaled(v, c), frames.cross(axis, v), s), along)
end

-- Quaternion w, x, y, z of the rotation matrix with columns x, y, z (Shepperd, 1978).
local function quaternion(x, y, z)
  local trace = x[1] + y[2] + z[3]
  local squares = {
    { 1 + trace, y[3] - z[2], z[1] - x[3], x[2] - y[1] },
    { y[3] - z[2], 1 + 2 * x[1] - trace, x[2] + y[1], z[1] + x[3] },
    { z[1] - x[3], x[2] + y[1], 1 + 2 * y[2] - trace, y[3] + z[2] },
    { x[2] - y[1], z[1] + x[3], y[3] + z[2], 1 + 2 * z[3] - trace },
  }
  local best = 1
  for k = 2, 4 do
    if squares[k][k] > squares[best][best] then best = k end
  end
  local factor = 1 / (2 * math.sqrt(squares[best][best]))
  local q = {}
  for k = 1, 4 do
    q[k] = factor * squares[best][k]
  end
  return q
end

-- Pose of the hand at a position: its fingers point along the unit vector `forward` and close along the unit vector
-- `closing`, which is perpendicular to it.
function frames.hand(position, forward, closing)
  return softvt.pose { position = position, quaternion = quaternion(frames.cross(closing, forward), closing, forward) }
end

-- Direction in which the fingers of a hand at a pose point.
function frames.forward(pose)
  local w, x, y, z = table.unpack(pose.quaternion)
  return { 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y) }
end

-- Angle from the x axis, wrapped to (-90°, 90°]: a hand that points down closes along the same line after half a turn.
function frames.half_turn_yaw(direction)
  local yaw = math.atan(direction[2], direction[1])
  if yaw > math.pi / 2 then return yaw - math.pi end
  if yaw <= -math.pi / 2 then return yaw + math.pi end
  return yaw
end

return frames
