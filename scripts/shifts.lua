-- Shifts that a suite may declare: factors on material parameters of all objects, on the mass of everything that moves, and on the
-- light. Also the nine standard conditions, which change one factor at a time.

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
  -- Applies to soft and rigid bodies and to the moving parts of articulations; sizes stay.
  mass = softvt.shift {
    name = "mass", unit = "1", default = 1, min = 0.01, max = 100,
    apply = function(scene, value)
      for _, object in ipairs(scene.objects) do object:scale_mass(value) end
      return scene
    end,
  },
  -- A pair of surfaces takes the larger coefficient. The friction of the pads is a setting, robot.pads.
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

-- The shifts of soft and of rigid suites.
shifts.soft = { shifts.mass, shifts.stiffness, shifts.light, shifts.friction }
shifts.rigid = { shifts.mass, shifts.light, shifts.friction }

-- Three levels of light, as factors on lamp and sky.
shifts.lights = { { "dim", 0.3 }, { "low", 0.6 }, { "bright", 2 } }

-- The nine standard conditions. Stiffness applies to deformable suites only.
shifts.conditions = {}
for _, factor in ipairs { 1.25, 1.75, 2.5 } do
  table.insert(shifts.conditions, { name = "mass x" .. factor, shift = { mass = factor } })
end
for _, factor in ipairs { 0.5, 0.8, 2.0 } do
  table.insert(shifts.conditions, { name = "stiffness x" .. factor, shift = { stiffness = factor }, only = "deformable" })
end
for _, level in ipairs(shifts.lights) do
  table.insert(shifts.conditions, { name = "light " .. level[1], shift = { light = level[2] } })
end

return shifts
