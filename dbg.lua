local layouts = require "layouts.floor"
local grasp = require "experts.grasp"
local opt = softvt.options { k = { default = 2, integer = true, help = "task", min=1, max=10 } }
local lay = layouts.rigid(opt.k)
return softvt.experiment { name="dbg", options=opt, grid = { a = {1} }, run = function(p, o)
  local sim = softvt.simulate { layout = lay }
  sim:drive(function(arm, scene)
    local object = scene:object(layouts.target(o.k))
    local h = grasp.height(object)
    print(object.name, object.xyz[1], object.xyz[2], object.xyz[3], object.size[1], object.size[2], object.size[3], object.yaw, h)
    for _, op in ipairs{0, grasp.clear(object,0.01), grasp.clear(object,0.005)} do
    for _, turn in ipairs{0, 0.26, -0.26} do
      local pose = grasp.pose(object, h, nil, turn)
      print(op, turn, scene:clearance(pose, { width = 0.08*(1-op), ignore = { object.name } }))
    end end
    local pose, c, room = grasp.choose(scene, object, h)
    print("chosen", tostring(pose), c, room)
    arm:wait(0.05)
  end)
  return { name = "x", m = 1 }
end }
