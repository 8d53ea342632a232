-- Grasps an object as the expert does, closes the hand to `closure` at once, and waits half a second. Returns the
-- fastest node of the 0.2 s that follow, and by how much D changes in them, %.
local grasp = require "experts.grasp"
local table_top = require "assets.table"
local function held(name)
  local asset = require("assets." .. name)
  return softvt.layout("held", function(scene)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "object", asset = asset, at = { -0.05, 0 } }
  end)
end
local layouts = { braided_roll = held "braided_roll", steamed_bun = held "steamed_bun", wedge = held "wedge" }
return softvt.experiment {
  name = "shut",
  points = function()
    return {
      { asset = "braided_roll", closure = 0.95 },
      { asset = "steamed_bun", closure = 0.95 },
      { asset = "wedge", closure = 1.0 },
    }
  end,
  run = function(point)
    local sim = softvt.simulate { layout = layouts[point.asset] }
    assert(sim:drive(function(arm, scene)
      local object = scene:object "object"
      arm:move_to(grasp.pose(object, grasp.height(object)), { speed = 0.6, angular_speed = 3 })
      arm:grasp(point.closure, { rate = 0.6 })
      arm:wait(0.5)
    end))
    local row = { asset = point.asset, mm_s = 0, det_f = 1, force_n = 0 }
    local least, most = math.huge, 0
    for _ = 1, 4 do
      assert(sim:wait(0.05))
      local seen = sim:measure "object"
      row.mm_s = math.max(row.mm_s, 1e3 * seen.speed)
      row.det_f = math.min(row.det_f, seen.min_det_f)
      row.force_n = math.min(table.unpack(seen.pad_force))
      least, most = math.min(least, seen.d_pct), math.max(most, seen.d_pct)
    end
    row.change_pct = 100 * (most / least - 1)
    return row
  end,
}
