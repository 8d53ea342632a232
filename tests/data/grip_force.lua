-- Closes on a cube whose centre is `offset` from the middle of the hand, m, until the pads press with `force`, N. The
-- cube is `density` times as heavy and `youngs` times as stiff as its asset; the friction of its support makes the
-- pads press unequally.
local grasp = require "experts.grasp"
local table_top, cube = require "assets.table", require "assets.cube"
local layouts = {}
local function layout(point)
  return softvt.layout("held", function(scene)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "object", asset = cube, at = { -0.05, 0 } }
    local object = scene:object "object"
    object.density, object.youngs_pa = point.density * object.density, point.youngs * object.youngs_pa
  end)
end
local points = {
  { density = 1, youngs = 1, force = 0.6, offset = 0 },
  { density = 3, youngs = 1, force = 0.8, offset = 1.5e-3 },
  { density = 5, youngs = 4, force = 2.2, offset = -1.5e-3 },
}
for k, point in ipairs(points) do
  layouts[k] = layout(point)
end
return softvt.experiment {
  name = "grip_force",
  points = function()
    local list = {}
    for k = 1, #points do
      list[k] = { k = k }
    end
    return list
  end,
  run = function(point)
    local wanted = points[point.k]
    local sim = softvt.simulate { layout = layouts[point.k] }
    local most = 0
    assert(sim:drive(function(arm, scene)
      local object = scene:object "object"
      arm:move_to(grasp.pose(object, grasp.height(object), { 0, wanted.offset }), { speed = 0.6, angular_speed = 3 })
      grasp.close(arm, object, { width = 0, force = wanted.force }, { closing_speed = 0.003, stop = "touch" })
      for _ = 1, 10 do
        arm:wait(arm.dt)
        most = math.max(most, 0.5 * (arm.force[1] + arm.force[2]))
      end
    end))
    local force = sim:measure("object").pad_force
    return {
      ratio = 0.5 * (force[1] + force[2]) / wanted.force,
      most = most / wanted.force,
      unequal = math.abs(force[1] - force[2]) / wanted.force,
    }
  end,
}
