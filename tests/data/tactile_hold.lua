-- Grips a block at a closure, lifts and holds it. Rows have both fingers at each stage.
local block = softvt.asset {
  name = "block",
  shape = softvt.shape.box({ size = { 0.06, 0.04, 0.05 } }):grounded(),
  body = BODY,
}
local ground = softvt.shape.box { size = { 1, 1, 0.05 } }
local floor = softvt.asset { name = "floor", shape = ground:translate(0, 0, -0.025), body = softvt.static {} }
local layout = softvt.layout("held", function(scene)
  scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
  scene:add { name = "block", asset = block, at = { 0, 0 } }
end)
return softvt.experiment {
  name = "hold",
  grid = { closure = { CLOSURE } },
  run = function(point)
    local sim, rows = softvt.simulate { layout = layout, settings = SETTINGS }, {}
    local function note(when)
      for _, side in ipairs { "left", "right" } do
        local felt, x, y, most = sim:tactile(side), 0, 0, 0
        for i, from in ipairs(felt.initial) do
          local dx, dy = felt.present[i][1] - from[1], felt.present[i][2] - from[2]
          x, y, most = x + dx / 99, y + dy / 99, math.max(most, math.abs(dx), math.abs(dy))
        end
        rows[#rows + 1] = {
          when = when,
          side = side,
          x = x,
          y = y,
          most = most,
          force = felt.force,
          mean = felt.image:mean(),
          depth_mm = felt.depth_mm,
        }
      end
    end
    note "open"
    assert(sim:drive(function(arm)
      local at = softvt.pose { position = { 0, 0, 0.027 } }
      arm:move_to(at:translated { 0, 0, 0.08 })
      arm:move_to(at)
      arm:close_to(point.closure)
      arm:wait(0.5)
    end))
    note "gripped"
    assert(sim:drive(function(arm)
      arm:move_by({ 0, 0, 0.08 }, { speed = 0.1 })
      arm:wait(0.5)
    end))
    note "lifted"
    assert(sim:wait(2))
    note "held"
    return rows
  end,
}
