-- Grips a fixed block or pin with 3 N, and moves the hand so little that the gel sticks. Rows have the shares of the
-- motion that the marker in the middle of the contact follows, and of the twist that its neighbours follow.
local shapes = {
  block = softvt.shape.box { size = { 0.04, 0.04, 0.04 } },
  pin = softvt.shape.cylinder({ radius = 0.004, height = 0.04 }):rotate { axis = "x", angle = math.pi / 2 },
}
local at = softvt.pose { position = { 0, 0, 0.2 } }
local motions = {
  sideways = function(pose) return pose:translated { 0.00025, 0, 0 } end,
  along = function(pose) return pose:translated { 0, 0, 0.00025 } end,
  -- About the axis along which the fingers close.
  twist = function(pose)
    return softvt.pose { position = pose.position, quaternion = { 0, math.cos(0.01), 0, -math.sin(0.01) } }
  end,
}
local ground = softvt.shape.box { size = { 1, 1, 0.05 } }
local floor = softvt.asset { name = "floor", shape = ground:translate(0, 0, -0.025), body = softvt.static {} }
-- The marker in the middle of the image, and how much later in the list those on its right and below it are.
local MIDDLE, NEIGHBOURS, MM_PER_PX = 50, { 1, 11 }, 0.0634

local function distance(a, b)
  local sum = 0
  for k = 1, #a do
    sum = sum + (b[k] - a[k]) ^ 2
  end
  return math.sqrt(sum)
end

-- Mean direction of the lines between the neighbours of the middle, rad.
local function direction(px)
  local sum = 0
  for _, k in ipairs(NEIGHBOURS) do
    local a, b = px[MIDDLE - k], px[MIDDLE + k]
    sum = sum + math.atan(b[2] - a[2], b[1] - a[1]) / #NEIGHBOURS
  end
  return sum
end

local function share(shape, motion)
  local solid = softvt.asset { name = "solid", shape = shapes[shape], body = softvt.static {} }
  local layout = softvt.layout("fixed", function(scene)
    scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
    scene:add { name = "solid", asset = solid, position = { 0, 0, 0.2 } }
  end)
  local sim = softvt.simulate { layout = layout }
  local function state()
    local position, axis = sim:tool()
    -- The hand points down: it is turned by half a turn about an axis near x.
    return { position = position, tilt = 2 * math.atan(axis[3], axis[1]), px = sim:tactile("left").present }
  end
  assert(sim:drive(function(arm)
    arm:move_to(at:translated { 0, 0, 0.08 })
    arm:move_to(at)
    arm:grasp(1, { force = 3 })
    arm:wait(1)
  end))
  local before = state()
  assert(sim:drive(function(arm)
    arm:move_to(motions[motion](arm.target))
    arm:wait(1)
  end))
  local after = state()
  if motion == "twist" then
    local turned = (after.tilt - before.tilt + math.pi) % (2 * math.pi) - math.pi
    return math.abs((direction(after.px) - direction(before.px)) / turned)
  end
  local markers_mm = MM_PER_PX * distance(before.px[MIDDLE], after.px[MIDDLE])
  return markers_mm / (1e3 * distance(before.position, after.position))
end

return softvt.experiment {
  name = "follow",
  grid = { shape = { "block", "pin" } },
  run = function(point)
    local row = { shape = point.shape }
    for motion in pairs(motions) do
      row[motion] = share(point.shape, motion)
    end
    return row
  end,
}
