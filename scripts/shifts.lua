-- Shifts that a suite may declare, each of one factor, and lists of conditions: the standard ones of the benchmark's
-- later release, our own, and perturbations of what the policy perceives and how its actions arrive.
local EXTRAS = {
  require "assets.tomato_sauce",
  require "assets.cream_cheese",
  require "assets.butter",
  require "assets.alphabet_soup",
}
-- Region and clearance of additional distractors, draws per distractor, m.
local REGION, CLEARANCE, DRAWS = { x = { -0.3, 0.3 }, y = { -0.42, 0.42 } }, 0.06, 400

-- "pick up the soft cube and place it in the basket" in other words: the object, "in" or "on", and the target.
local PARAPHRASES =
  { "put the %s %s the %s", "take the %s and set it down %s the %s", "move the %s so that it lies %s the %s" }

-- A factor on numbers of the materials of all objects.
local function factor(name, keys, min, max)
  return softvt.shift {
    name = name,
    unit = "1",
    default = 1,
    min = min,
    max = max,
    apply = function(scene, value)
      for _, object in ipairs(scene.objects) do
        for _, key in ipairs(keys) do
          if object[key] then object[key] = object[key] * value end
        end
      end
    end,
  }
end

-- A vector of uniformly distributed direction and the given length.
local function random_vector(rng, length)
  local x, y, z = rng:normal(0, 1), rng:normal(0, 1), rng:normal(0, 1)
  local scale = length / math.max(1e-9, math.sqrt(x * x + y * y + z * z))
  return x * scale, y * scale, z * scale
end

-- The product of two quaternions w, x, y, z.
local function product(a, b)
  return {
    a[1] * b[1] - a[2] * b[2] - a[3] * b[3] - a[4] * b[4],
    a[1] * b[2] + a[2] * b[1] + a[3] * b[4] - a[4] * b[3],
    a[1] * b[3] - a[2] * b[4] + a[3] * b[1] + a[4] * b[2],
    a[1] * b[4] + a[2] * b[3] - a[3] * b[2] + a[4] * b[1],
  }
end

local shifts = {
  -- The object of the task's goal alone, as in the later release.
  target_mass = softvt.shift {
    name = "target_mass",
    unit = "1",
    default = 1,
    min = 0.01,
    max = 100,
    apply = function(scene, value) scene.goal_object:scale_mass(value) end,
  },
  target_stiffness = softvt.shift {
    name = "target_stiffness",
    unit = "1",
    default = 1,
    min = 0.01,
    max = 100,
    apply = function(scene, value)
      local object = scene.goal_object
      object.youngs_pa = object.youngs_pa * value
    end,
  },
  -- All objects.
  stiffness = factor("stiffness", { "youngs_pa" }, 0.01, 100),
  -- Applies to soft and rigid bodies and to the moving parts of articulations; sizes stay.
  mass = softvt.shift {
    name = "mass",
    unit = "1",
    default = 1,
    min = 0.01,
    max = 100,
    apply = function(scene, value)
      for _, object in ipairs(scene.objects) do
        object:scale_mass(value)
      end
    end,
  },
  -- A pair of surfaces takes the larger coefficient. The friction of the pads is a setting, robot.pads.
  friction = factor("friction", { "static_mu", "dynamic_mu" }, 0, 10),
  light = softvt.shift {
    name = "light",
    unit = "1",
    default = 1,
    min = 0.01,
    max = 20,
    apply = function(scene, value)
      scene.light.strength = scene.light.strength * value
      scene.light.sky_strength = scene.light.sky_strength * value
    end,
  },
  -- Moves the third-person camera by so many cm in a random direction and turns it by as many degrees about a random
  -- axis.
  camera = softvt.shift {
    name = "camera",
    unit = "cm and degrees",
    default = 0,
    min = 0,
    max = 20,
    apply = function(scene, value, rng)
      local draws, camera = rng:stream "camera", scene:camera "third_person"
      local p, x, y, z = camera.position, random_vector(draws, value / 100)
      camera.position = { p[1] + x, p[2] + y, p[3] + z }
      local half = math.rad(value) / 2
      local ax, ay, az = random_vector(draws, math.sin(half))
      camera.quaternion = product({ math.cos(half), ax, ay, az }, camera.quaternion)
    end,
  },
  -- Adds so many rigid objects at random free places.
  distractors = softvt.shift {
    name = "distractors",
    unit = "1",
    default = 0,
    min = 0,
    max = #EXTRAS,
    apply = function(scene, value, rng)
      for k = 1, math.floor(value) do
        local low, high = EXTRAS[k].shape:bounds()
        local radius = math.sqrt(math.max(-low[1], high[1]) ^ 2 + math.max(-low[2], high[2]) ^ 2)
        local x, y, is_free
        for _ = 1, DRAWS do
          x, y = rng:uniform(table.unpack(REGION.x)), rng:uniform(table.unpack(REGION.y))
          is_free = scene:distance_to_objects(x, y) > radius + CLEARANCE
          if is_free then break end
        end
        if not is_free then error(("shift distractors: no free place for object %d; give fewer"):format(k)) end
        scene:add { name = "extra_" .. k, asset = EXTRAS[k], at = { x, y } }
      end
    end,
  },
  -- The instruction in other words: 1, 2 or 3.
  prompt = softvt.shift {
    name = "prompt",
    unit = "1",
    default = 0,
    min = 0,
    max = #PARAPHRASES,
    apply = function(scene, value)
      if value < 1 then return end
      local what, where, target = scene.prompt:match "^pick up the (.-) and place it (%a+) the (.+)$"
      if not what then
        error(
          ('shift prompt: there is no paraphrase of %q; it has those of "pick up the … and place it in the …"'):format(
            scene.prompt
          )
        )
      end
      scene.prompt = PARAPHRASES[math.floor(value)]:format(what, where, target)
    end,
  },
}

-- The shifts of soft and of rigid suites.
shifts.rigid = {
  shifts.target_mass,
  shifts.mass,
  shifts.light,
  shifts.friction,
  shifts.camera,
  shifts.distractors,
  shifts.prompt,
}
shifts.soft = { shifts.target_stiffness, shifts.stiffness, table.unpack(shifts.rigid) }

-- Conditions of one shift with several values. Those of stiffness apply to deformable suites only.
local function levels(list, shift, values)
  local only = shift:match "stiffness$" and "deformable" or nil
  for _, value in ipairs(values) do
    list[#list + 1] =
      { name = ("%s x%.4g"):format(shift:gsub("_", " "), value), shift = { [shift] = value }, only = only }
  end
end

-- The nine standard conditions, those of the later release: mass and stiffness of the target, and light.
shifts.conditions = {}
levels(shifts.conditions, "target_mass", { 1.25, 1.75, 2.5 })
levels(shifts.conditions, "target_stiffness", { 0.5, 0.8, 2 })
levels(shifts.conditions, "light", { 0.5, 4 / 3, 2 })

-- Our own: all objects, and darker light.
shifts.all_objects = {}
levels(shifts.all_objects, "mass", { 1.25, 1.75, 2.5 })
levels(shifts.all_objects, "stiffness", { 0.5, 0.8, 2 })
levels(shifts.all_objects, "light", { 0.3, 0.6 })

-- What the policy perceives, how its actions arrive, and the rigid twin.
shifts.perturbations = {
  { name = "camera 2 cm", shift = { camera = 2 } },
  { name = "camera 5 cm", shift = { camera = 5 } },
  { name = "two distractors", shift = { distractors = 2 } },
  { name = "paraphrase 1", shift = { prompt = 1 } },
  { name = "paraphrase 2", shift = { prompt = 2 } },
  { name = "tactile noise", set = { ["tactile.wear.noise_px"] = 0.5, ["tactile.wear.image_noise"] = 5 } },
  {
    name = "gel wear",
    set = { ["tactile.wear.gain"] = 0.7, ["tactile.wear.offset_px"] = 0.5, ["tactile.wear.dead_share"] = 0.2 },
  },
  { name = "latency 50 ms", set = { ["robot.latency"] = 1 } },
  { name = "latency 150 ms", set = { ["robot.latency"] = 3 } },
  {
    name = "disturbance 3 mm",
    set = { ["robot.disturbance.position"] = 0.003, ["robot.disturbance.rotation"] = 0.01 },
  },
  { name = "rigid twin", rigid_twin = true },
}

return shifts
