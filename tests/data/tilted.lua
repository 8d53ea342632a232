-- Soft objects that settle otherwise than they are modelled, placed on a plate by the standard expert.
local pick_place, plate, table_top = require "experts.pick_place", require "assets.plate", require "assets.table"
local shape = softvt.shape
local cone = shape.lathe { corners = { { 0, 0 }, { 0.017, 0 }, { 0.003, 0.04 }, { 0, 0.04 } } }
local berry = shape.lathe { corners = { { 0, 0 }, { 0.002, 0 }, { 0.014, 0.02 }, { 0.012, 0.03 }, { 0, 0.034 } } }
local egg = shape.ellipsoid { size = { 0.036, 0.036, 0.052 } }
local function task(name, of)
  local asset = softvt.asset {
    name = name,
    shape = of:grounded(),
    body = softvt.soft { youngs_pa = 1e5, poisson = 0.4, density = 500, damage_strain = 0.15 },
  }
  local layout = softvt.layout(name, function(scene)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "plate", asset = plate, at = { 0.04, 0.12 } }
    scene:add { name = "thing", asset = asset, at = { -0.04, -0.12 }, yaw = 0.4 }
  end)
  return softvt.task {
    prompt = "place the " .. name,
    layout = layout,
    goal = softvt.on { object = "thing", target = "plate" },
    expert = pick_place { object = "thing", target = "plate" },
  }
end
return softvt.suite {
  name = "tilted",
  object_type = "deformable",
  tasks_differ_in = "object",
  episodes = 1,
  tasks = {
    -- It rolls onto its shallow flank.
    task("cone", cone:rotate { axis = "x", angle = math.rad(90) }),
    -- It stands on its tip, and falls over.
    task("berry", berry:round(0.001)),
    -- It stands on its thin end.
    task("egg", egg:rotate { axis = "x", angle = 0.3 }),
  },
}
