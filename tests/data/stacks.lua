-- Stacks of assets, each of which lies on the one before.
local mark = softvt.asset { name = "mark", shape = softvt.shape.box { size = { 0.02, 0.02, 0.02 } }:grounded(), body = softvt.rigid { density = 500 } }
local tasks, all, assets = {}, { STACKS }, { table = require "assets.table" }
for _, names in ipairs(all) do
  for _, name in ipairs(names) do assets[name] = require("assets." .. name) end
end
for _, names in ipairs(all) do
  local layout = softvt.layout(table.concat(names, "_"), function(scene)
    scene:add { name = "table", asset = assets.table, position = { 0, 0, 0 } }
    for i, name in ipairs(names) do
      local on = i > 1 and names[i - 1] or nil
      scene:add { name = name, asset = assets[name], at = { 0.05, 0.02 }, yaw = 0.3 * i, on = on }
    end
    scene:add { name = "mark", asset = mark, at = { 0.35, -0.3 } }
  end)
  -- A marker, since the object of a goal must be movable and some of the assets are not.
  local goal = softvt.on { object = "mark", target = "table" }
  tasks[#tasks + 1] = softvt.task { prompt = table.concat(names, " under "), layout = layout, goal = goal }
end
return softvt.suite { name = "stacks", object_type = "rigid", tasks_differ_in = "object", tasks = tasks }
