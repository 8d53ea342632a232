-- Household: tasks of two to four steps with soft and rigid things on a kitchen table.
local drawer, knob = require "experts.drawer", require "experts.knob"
local layouts = require "layouts.household"
local pick_place = require "experts.pick_place"
local push = require "experts.push"
local sequence = require "experts.sequence"
local shifts = require "shifts"

-- BEGIN SHIM
local goals = {}
for _, name in ipairs {
  "on",
  "inside",
  "opened",
  "closed",
  "turned",
  "near",
  "left_of",
  "right_of",
  "in_front_of",
  "behind",
  "stacked",
  "upright",
  "all",
  "any",
  "none",
  "sequence",
} do
  local known, all = pcall(function() return softvt.all end)
  goals[name] = known and all and softvt[name] or function(spec) return { shim = name, spec = spec } end
end
local known_all, all = pcall(function() return softvt.all end)
local shimmed = not (known_all and all)
-- The last on or inside of a goal.
local function last(goal)
  if goal.shim == "on" or goal.shim == "inside" then
    return softvt[goal.shim] { object = goal.spec.object, target = goal.spec.target, hold_s = 10 }
  end
  if goal.shim == "none" then return nil end
  if goal.shim == "stacked" then
    local o = goal.spec.objects
    return softvt.on { object = o[#o], target = o[#o - 1], hold_s = 10 }
  end
  for k = #goal.spec, 1, -1 do
    local found = last(goal.spec[k])
    if found then return found end
  end
end
local function goal_object(goal)
  if goal.spec.object then return goal.spec.object end
  for _, g in ipairs(goal.spec) do
    local o = goal_object(g)
    if o then return o end
  end
end
local function at(scene, name)
  local object, part = name:match "^(.-)%.(.+)$"
  if object then return scene:part(object, part) end
  return scene:object(name)
end
local function holds(goal, scene, say)
  local s, kind = goal.spec, goal.shim
  local function offset()
    local a, b = at(scene, s.object).centre, at(scene, s.target).centre
    return a[1] - b[1], a[2] - b[2], a[3] - b[3]
  end
  local result
  if kind == "on" or kind == "inside" then
    local x, y, z = offset()
    local t = at(scene, s.target)
    result = math.sqrt(x * x + y * y) < math.min(t.size[1], t.size[2]) / 2 and z > 0
      or (kind == "inside" and math.sqrt(x * x + y * y) < 0.08 and z > -0.07)
  elseif kind == "opened" then
    result = at(scene, s.joint).joint >= 0.15 * s.share
  elseif kind == "closed" then
    result = at(scene, s.joint).joint <= 0.15 * s.share
  elseif kind == "turned" then
    result = at(scene, s.joint).joint >= s.range[1] and at(scene, s.joint).joint <= s.range[2]
  elseif kind == "near" then
    local x, y = offset()
    result = math.sqrt(x * x + y * y) <= s.distance
  elseif kind == "left_of" then
    local x, y = offset()
    result = y >= 0.05 and math.abs(x) <= y
  elseif kind == "right_of" then
    local x, y = offset()
    result = -y >= 0.05 and math.abs(x) <= -y
  elseif kind == "behind" then
    local x, y = offset()
    result = x >= 0.05 and math.abs(y) <= x
  elseif kind == "in_front_of" then
    local x, y = offset()
    result = -x >= 0.05 and math.abs(y) <= -x
  elseif kind == "stacked" then
    result = true
    for k = 2, #s.objects do
      local a, b = at(scene, s.objects[k]), at(scene, s.objects[k - 1])
      local x, y, z = a.centre[1] - b.centre[1], a.centre[2] - b.centre[2], a.centre[3] - b.centre[3]
      result = result and math.sqrt(x * x + y * y) < 0.03 and math.abs(z - (a.size[3] + b.size[3]) / 2) < 0.006
    end
  elseif kind == "all" then
    result = true
    for _, g in ipairs(s) do
      result = holds(g, scene, say) and result
    end
  elseif kind == "any" then
    result = false
    for _, g in ipairs(s) do
      result = holds(g, scene, say) or result
    end
  elseif kind == "none" then
    result = true
    for _, g in ipairs(s) do
      result = not holds(g, scene, say) and result
    end
  elseif kind == "sequence" then
    result = holds(s[#s], scene, say)
  end
  return result
end
local function make_task(spec)
  if shimmed then
    local goal, expert = spec.goal, spec.expert
    spec.goal = last(spec.goal)
    if spec.never then spec.goal = softvt.on { object = goal_object(goal), target = spec.never } end
    spec.never = nil
    spec.object = nil
    spec.budget_steps = spec.budget_steps + 220
    spec.expert = function(arm, scene)
      expert(arm, scene)
      arm:wait(0.3)
      arm:note("ok", holds(goal, scene) and 1 or 0)
      arm:note("t", arm.time * 20)
    end
  end
  return softvt.task(spec)
end
-- END SHIM

local tasks = {
  {
    never = "plate",
    prompt = "open the top drawer of the cabinet, put the ridged roll in it and close it",
    layout = layouts.cabinet("drawer", 0, {
      { "roll", "small_ridged_roll", -200, 80 },
      { "plate", "plate", 60, 210 },
      { "bun", "golden_bun", -90, 230 },
    }),
    goal = goals.sequence {
      goals.opened { joint = "cabinet.top_drawer", share = 0.7 },
      goals.all {
        goals.inside { object = "roll", target = "cabinet.top_drawer" },
        goals.closed { joint = "cabinet.top_drawer", share = 0.1 },
      },
    },
    expert = sequence {
      drawer { joint = "cabinet.top_drawer" },
      pick_place { object = "roll", target = "cabinet.top_drawer" },
      drawer { joint = "cabinet.top_drawer", close = true },
    },
    budget_steps = 1300,
  },
  {
    prompt = "close the top drawer of the cabinet and put the sesame bun on top of the cabinet",
    layout = layouts.cabinet("top", 0.12, {
      { "bun", "sesame_bun", -200, 100 },
      { "plate", "plate", 60, 210 },
      { "roll", "small_ridged_roll", -90, 230 },
    }),
    goal = goals.all {
      goals.closed { joint = "cabinet.top_drawer", share = 0.1 },
      goals.on { object = "bun", target = "cabinet" },
    },
    expert = sequence {
      drawer { joint = "cabinet.top_drawer", close = true },
      pick_place { object = "bun", target = "cabinet" },
    },
    budget_steps = 900,
  },
  {
    never = "bun",
    prompt = "take the capsule out of the top drawer, put it on the plate and close the drawer",
    layout = layouts.cabinet("take", 0.14, {
      { "plate", "plate", 60, 210 },
      { "bun", "golden_bun", -200, 100 },
      { "capsule", "capsule", 0, -155, yaw = math.pi / 2, on = "cabinet.top_drawer" },
    }),
    goal = goals.all {
      goals.on { object = "capsule", target = "plate" },
      goals.closed { joint = "cabinet.top_drawer", share = 0.1 },
    },
    expert = sequence {
      pick_place { object = "capsule", target = "plate" },
      drawer { joint = "cabinet.top_drawer", close = true },
    },
    budget_steps = 900,
  },
  {
    prompt = "push the ramekin next to the plate and put the steamed bun on the plate",
    layout = layouts.cabinet("ramekin", 0, {
      { "plate", "plate", 90, 170 },
      { "ramekin", "ramekin", -190, 40 },
      { "bun", "steamed_bun", -120, 260 },
    }),
    goal = goals.all {
      goals.near { object = "ramekin", target = "plate", distance = 0.15 },
      goals.on { object = "bun", target = "plate" },
    },
    expert = sequence {
      push { object = "ramekin", target = "plate", distance = 0.135 },
      pick_place { object = "bun", target = "plate" },
    },
    budget_steps = 900,
  },
  {
    prompt = "put the golden bun to the left of the plate, as the robot sees it, then the croissant on the plate",
    layout = layouts.cabinet("left", 0, {
      { "plate", "plate", 60, 120 },
      { "bun", "golden_bun", -160, -20 },
      { "croissant", "croissant", -170, 170 },
    }),
    goal = goals.sequence {
      goals.left_of { object = "bun", target = "plate" },
      goals.all {
        goals.left_of { object = "bun", target = "plate" },
        goals.on { object = "croissant", target = "plate" },
      },
    },
    expert = sequence {
      pick_place { object = "bun", target = "plate", to = "left_of", distance = 0.14 },
      pick_place { object = "croissant", target = "plate" },
    },
    budget_steps = 900,
  },
  {
    never = "butter",
    prompt = "put the spiral roll on the plate and turn the stove on",
    layout = layouts.stove("on", 0, {
      { "plate", "plate", 80, 180 },
      { "roll", "spiral_roll", 60, -100 },
      { "butter", "butter", -120, 230 },
    }),
    goal = goals.all {
      goals.on { object = "roll", target = "plate" },
      goals.turned { joint = "stove.knob", range = { 0.5, 4.72 } },
    },
    expert = sequence {
      pick_place { object = "roll", target = "plate" },
      knob { joint = "stove.knob", angle = 0.64 },
    },
    budget_steps = 1000,
  },
  {
    prompt = "stack the butter on the cookies and the ridged roll on the butter",
    layout = layouts.stove("stack", 0, {
      { "cookies", "cookies", 60, 150 },
      { "butter", "butter", -60, 20 },
      { "roll", "small_ridged_roll", 110, -70 },
    }),
    goal = goals.stacked { objects = { "cookies", "butter", "roll" } },
    expert = sequence {
      pick_place { object = "butter", target = "cookies" },
      pick_place { object = "roll", target = "butter" },
    },
    budget_steps = 900,
  },
  {
    prompt = "put the butter and the yellow roll into the basket",
    layout = layouts.stove("basket", 0, {
      { "basket", "basket", 60, 230 },
      { "butter", "butter", -90, 0 },
      { "roll", "yellow_roll", 90, -70 },
    }),
    goal = goals.all {
      goals.inside { object = "butter", target = "basket" },
      goals.inside { object = "roll", target = "basket" },
    },
    expert = sequence {
      pick_place { object = "butter", target = "basket" },
      pick_place { object = "roll", target = "basket" },
    },
    budget_steps = 900,
  },
  {
    never = "roll",
    prompt = "clear the plate: put the loaf that lies on it into the basket, and turn the stove off",
    layout = layouts.stove("clear", 0.62, {
      { "basket", "basket", 60, 230 },
      { "plate", "plate", 60, -60 },
      { "loaf", "oval_loaf", 0, 0, on = "plate" },
      { "roll", "small_ridged_roll", -130, 60 },
    }),
    goal = goals.all {
      goals.none { goals.on { object = "loaf", target = "plate" }, goals.on { object = "roll", target = "plate" } },
      goals.inside { object = "loaf", target = "basket" },
      goals.turned { joint = "stove.knob", range = { -0.01, 0.15 } },
    },
    expert = sequence {
      pick_place { object = "loaf", target = "basket" },
      knob { joint = "stove.knob", angle = 0.04 },
    },
    budget_steps = 1000,
  },
  {
    prompt = "push the cookies behind the plate, and put the cylinder on the plate or on the cookies",
    layout = layouts.stove("behind", 0, {
      { "plate", "plate", -60, 150 },
      { "cookies", "cookies", 50, 0 },
      { "cylinder", "cylinder", -180, 20 },
    }),
    goal = goals.all {
      goals.behind { object = "cookies", target = "plate" },
      goals.any {
        goals.on { object = "cylinder", target = "plate" },
        goals.on { object = "cylinder", target = "cookies" },
      },
    },
    expert = sequence {
      push { object = "cookies", target = "plate", to = "behind" },
      pick_place { object = "cylinder", target = "plate" },
    },
    budget_steps = 900,
  },
}
for k, spec in ipairs(tasks) do
  tasks[k] = make_task(spec)
end

return softvt.suite {
  name = "household",
  object_type = "deformable",
  tasks_differ_in = "object",
  needs = "nothing",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.soft,
}
