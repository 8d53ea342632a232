-- Lowers the hand over the cube, closes with 3 N, lifts it, presses with 5 N, and opens.
local step, at, turn = 0, nil, nil
return softvt.policy {
  name = "force",
  observes = {},
  act = function(obs)
    if not at then
      at, turn = { table.unpack(obs.position) }, obs.axis_angle
    end
    step = step + 1
    local goal = { 0.66, 0.1, step < 40 and 0.14 or step < 130 and 0.01 or 0.05 }
    for i = 1, 3 do
      at[i] = at[i] + math.max(-0.02, math.min(0.02, goal[i] - at[i]))
    end
    local force = step < 60 and -1 or step < 160 and 3 or step < 220 and 5 or -1
    return { position = { table.unpack(at) }, axis_angle = turn, force = force }
  end,
}
