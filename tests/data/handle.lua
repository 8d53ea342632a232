-- Forces of the pads on the handle of a drawer of the standard cabinet. Point `grip`: both pads hold the bar. Point
-- `edge`: the hand comes wide open, so that the lower finger stops at the handle below and the edge of a pad meets the
-- bar obliquely; nothing has friction.
local floor = softvt.asset {
  name = "floor",
  shape = softvt.shape.box { size = { 2, 2, 0.05 } }:translate(0, 0, -0.025),
  body = softvt.static {},
}
local wooden_cabinet = require "assets.wooden_cabinet"
local function layout(name, has_friction)
  return softvt.layout(name, function(scene)
    scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
    scene:add { name = "cabinet", asset = wooden_cabinet, at = { 0, 0.25 } }
    for _, object in ipairs(scene.objects) do
      if not has_friction then
        object.dynamic_mu, object.static_mu = 0, 0
      end
    end
  end)
end
local FRICTIONLESS = { robot = { pads = { static_mu = 0, dynamic_mu = 0 } } }
local CASES = {
  grip = { scene = { layout = layout("rough", true) }, opening = 0.5 },
  edge = { scene = { layout = layout("smooth", false), settings = FRICTIONLESS }, opening = 0 },
}
return softvt.experiment {
  name = "handle",
  grid = { case = { "grip", "edge" } },
  run = function(point)
    local case, row = CASES[point.case], { case = point.case }
    local sim = softvt.simulate(case.scene)
    assert(sim:drive(function(arm, scene)
      local cabinet, drawer = scene:object "cabinet", scene:part("cabinet", "top_drawer")
      local x, y = cabinet.centre[1], 0.25 - drawer.hints.handle_out_m
      -- The fingers point forward, above and below the bar.
      local grip =
        softvt.pose { position = { x, y, drawer.hints.handle_height_m }, quaternion = { 0.7071, -0.7071, 0, 0 } }
      arm:close_to(case.opening)
      arm:move_to(grip:translated { 0, -0.08, 0 }, { speed = 0.3 })
      arm:move_to(grip, { speed = 0.1 })
      arm:close_to(0.95)
      arm:wait(1)
      row.arm = { arm.force[1], arm.force[2] }
    end))
    row.on = { 0, 0 }
    for _, name in ipairs { "floor", "cabinet", "cabinet.top_drawer", "cabinet.middle_drawer", "cabinet.bottom_drawer" } do
      local on = sim:measure(name).pad_force
      row.on = { row.on[1] + on[1], row.on[2] + on[2] }
    end
    row.handle = sim:measure "cabinet.top_drawer".pad_force
    row.gel = { sim:tactile "left".force, sim:tactile "right".force }
    return row
  end,
}
