-- The floor scene of the Object suites: a target among five distractors, and a basket. Positions are LIBERO's.
local arrange = require "layouts.arrange"
local basket = require "assets.basket"
local floor = require "assets.floor"
local scenery = require "scenery"

local mm = 1e-3
local BASKET = { 0, 260 * mm }
-- Positions of the target (near or far) and of the distractors, in LIBERO's order.
local NEAR, FAR = { 50 * mm, -100 * mm }, { -120 * mm, -240 * mm }
local OTHERS = { { -150 * mm, 60 * mm }, { 100 * mm, -200 * mm }, { 150 * mm, 30 * mm }, { -200 * mm, -80 * mm } }
-- Random ranges: soft objects are displaced and rotated, rigid ones keep LIBERO's regions.
local SOFT = { position_range = 20 * mm, yaw_range = math.rad(30) }
local RIGID = { position_range = 25 * mm, yaw_range = 0 }
local REGION = 10 * mm
-- Clearance between objects, and around the target for a finger with its sensor.
local CLEARANCE, TARGET_CLEARANCE = 12 * mm, 20 * mm

-- Targets and distractors by task, in LIBERO's order.
local TASKS = {
  { "alphabet_soup", far = true, "salad_dressing", "cream_cheese", "milk", "tomato_sauce", "butter" },
  { "cream_cheese", "alphabet_soup", "milk", "tomato_sauce", "butter", "orange_juice" },
  { "salad_dressing", "ketchup", "alphabet_soup", "cream_cheese", "milk", "tomato_sauce" },
  { "bbq_sauce", "chocolate_pudding", "ketchup", "salad_dressing", "alphabet_soup", "cream_cheese" },
  { "ketchup", far = true, "bbq_sauce", "salad_dressing", "alphabet_soup", "cream_cheese", "milk" },
  { "tomato_sauce", "milk", "butter", "orange_juice", "chocolate_pudding", "bbq_sauce" },
  { "butter", far = true, "tomato_sauce", "orange_juice", "chocolate_pudding", "bbq_sauce", "ketchup" },
  { "milk", far = true, "cream_cheese", "tomato_sauce", "butter", "orange_juice", "chocolate_pudding" },
  { "chocolate_pudding", far = true, "orange_juice", "bbq_sauce", "ketchup", "salad_dressing", "alphabet_soup" },
  { "orange_juice", "butter", "chocolate_pudding", "bbq_sauce", "ketchup", "salad_dressing" },
}

local layouts = {}

-- The name of the k-th rigid target.
function layouts.target(k) return TASKS[k][1] end

-- `asset` at the target's position among the distractors of the k-th task.
local function layout(name, asset, k, range)
  local task = TASKS[k] or error("there are ten arrangements", 3)
  local recipe, objects = require("assets." .. asset), {}
  local function add(other, at, range)
    objects[#objects + 1] = {
      name = other,
      asset = require("assets." .. other),
      at = at,
      position_range = range.position_range,
      yaw_range = range.yaw_range,
    }
  end
  add(asset, task.far and FAR or NEAR, range)
  objects[1].clearance, objects[1].reachable = TARGET_CLEARANCE, true
  add(task[2], task.far and NEAR or FAR, RIGID)
  for i, at in ipairs(OTHERS) do
    add(task[i + 2], at, RIGID)
  end
  objects[#objects + 1] = { name = "basket", asset = basket, at = BASKET, position_range = REGION }
  return softvt.layout(name, function(scene, rng)
    scene.base = { -0.6, 0, 0 }
    local camera = scene:camera "third_person"
    camera.position, camera.quaternion = { 0.8966, 0, 0.65 }, { 0.6182, 0.3432, 0.3432, 0.6182 }
    scene:add { name = "floor", asset = floor, position = { 0.75, 0, 0 } }
    arrange.add(scene, rng, objects, CLEARANCE)
    scenery.floor_room(scene)
    arrange.arm(scene, rng)
  end)
end

function layouts.rigid(k) return layout(("floor_%d"):format(k), TASKS[k][1], k, RIGID) end

function layouts.soft(asset, k) return layout(("floor_%d_%s"):format(k, asset), asset, k, SOFT) end

return layouts
