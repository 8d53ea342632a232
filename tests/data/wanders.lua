-- Moves at random, depending on its observation, in chunks of three.
local n = 0
return softvt.policy { name = 'wanders', observes = { tactile = true, cameras = { 'wrist' } }, replan = 2,
  reset = function(task) n = task.episode end,
  act = function(obs)
    n = n + 1
    local light, list = obs:camera('wrist'):mean()[1] / 255, {}
    for i = 1, 3 do
      list[i] = { position = { obs.position[1] + 0.01 * math.random(), obs.position[2], obs.position[3] - 0.001 * n * light },
                  axis_angle = obs.axis_angle, closure = 0.1 * math.random() }
    end
    return list
  end }
