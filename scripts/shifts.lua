-- Changes of a scene that a suite may declare: factors on the material of every object that has it, and on the light.

local function factor(name, keys, min, max)
  return softvt.shift {
    name = name, unit = "1", default = 1, min = min, max = max,
    apply = function(scene, value)
      for _, object in ipairs(scene.objects) do
        for _, key in ipairs(keys) do
          if object[key] then object[key] = object[key] * value end
        end
      end
      return scene
    end,
  }
end

local shifts = {
  stiffness = factor("stiffness", { "youngs_pa" }, 0.01, 100),
  mass = factor("mass", { "density" }, 0.01, 100),
  -- Of two surfaces the larger coefficient counts: that of the pads is a setting, robot.pads.
  friction = factor("friction", { "static_mu", "dynamic_mu" }, 0, 10),
  light = softvt.shift {
    name = "light", unit = "1", default = 1, min = 0.01, max = 20,
    apply = function(scene, value)
      scene.light.strength = scene.light.strength * value
      scene.light.sky_strength = scene.light.sky_strength * value
      return scene
    end,
  },
}

-- What suites of soft and of rigid objects declare.
shifts.soft = { shifts.mass, shifts.stiffness, shifts.light, shifts.friction }
shifts.rigid = { shifts.mass, shifts.light, shifts.friction }

return shifts
