-- Picks an object up and puts it down on (or into) another: approach, grasp, lift, carry, place, let go, retreat.
--
--   expert = pick_place { object = "left", target = "plate" }
local grasp = require "experts.grasp"

-- Clearance over everything while carrying, and over the target when letting go, m.
local CARRY, DROP = 0.12, 0.001
local DEFAULTS = { object = false, target = false, closure = false, speed = 0.4 }

local function checked(spec)
  for key in pairs(spec) do
    if DEFAULTS[key] == nil then error("pick_place: unknown field " .. tostring(key), 3) end
  end
  if type(spec.object) ~= "string" or type(spec.target) ~= "string" then
    error("pick_place: object and target must name objects of the scene", 3)
  end
  return spec
end

return function(spec)
  checked(spec)
  local speed = spec.speed or DEFAULTS.speed

  return function(arm, scene)
    local object, target = scene:object(spec.object), scene:object(spec.target)
    local height = grasp.height(object)
    local closure = spec.closure or grasp.closure(object)
    local at = grasp.pose(object, height)
    local over = grasp.pose(object, CARRY)

    -- Open as far as the neighbours allow and come straight down.
    arm:move_to(over, { speed = speed })
    arm:move_to(at, { speed = 0.25 })
    arm:wait(0.1)
    arm:grasp(closure, { rate = 0.6 })
    arm:wait(0.3)

    -- Straight up before going anywhere.
    arm:move_to(over, { speed = 0.25 })
    local held = scene:object(spec.object)
    local surface = target.hints.surface_m or target.size[3]
    local bottom = target.xyz[3] - target.size[3] / 2
    local down = bottom + surface + height + DROP
    -- The object may hang a little off the tool's axis; that offset goes with it.
    local dx, dy = held.xyz[1] - arm.pose.x, held.xyz[2] - arm.pose.y
    local place = softvt.pose { xyz = { target.xyz[1] - dx, target.xyz[2] - dy, down }, quat = arm.target.quat }
    arm:move_to(place:moved { 0, 0, CARRY - height }, { speed = speed })
    arm:move_to(place, { speed = 0.2 })
    arm:wait(0.2)

    -- Only as wide as needed: a plate's rim may be near.
    arm:release { closure = grasp.clear(object), rate = 0.4 }
    arm:wait(0.1)
    arm:move_by({ 0, 0, 0.08 }, { speed = 0.25 })
  end
end
