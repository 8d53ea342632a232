-- Changes of a scene that a suite may declare: factors on the material of every object that has it.

local function factor(name, key)
  return softvt.shift {
    name = name, unit = "1", default = 1, min = 0.01, max = 100,
    apply = function(scene, value)
      for _, object in ipairs(scene.objects) do
        if object[key] then object[key] = object[key] * value end
      end
      return scene
    end,
  }
end

return { stiffness = factor("stiffness", "youngs_pa"), mass = factor("mass", "density") }
