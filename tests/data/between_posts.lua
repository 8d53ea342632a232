-- An oval loaf between two posts that stand where the fingers of a straight grasp would be.
local pick_place, table_top = require "experts.pick_place", require "assets.table"
local loaf, plate = require "assets.oval_loaf", require "assets.plate"
local post = softvt.asset {
  name = "post",
  shape = softvt.shape.box { size = { 0.004, 0.004, 0.08 } }:grounded(),
  body = softvt.static {},
}
local layout = softvt.layout("between_posts", function(scene)
  scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
  scene:add { name = "loaf", asset = loaf, at = { -0.05, 0 } }
  scene:add { name = "plate", asset = plate, at = { -0.05, 0.22 } }
  for _, side in ipairs { -1, 1 } do
    scene:add { name = side < 0 and "near" or "far", asset = post, at = { -0.05 + side * POST_X, side * 0.056 } }
  end
end)
return softvt.suite {
  name = "turned",
  object_type = "deformable",
  tasks_differ_in = "object",
  episodes = 1,
  tasks = {
    softvt.task {
      prompt = "put the loaf on the plate",
      layout = layout,
      goal = softvt.on { object = "loaf", target = "plate", hold_s = 0.4 },
      expert = pick_place { object = "loaf", target = "plate", window = 0 },
    },
  },
}
