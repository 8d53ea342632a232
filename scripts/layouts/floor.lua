-- The floor scene of the Object suites: a target among five distractors on the floor, and a basket. Places are LIBERO's.
local arrange = require "layouts.arrange"
local basket = require "assets.basket"
local floor = require "assets.floor"
local scenery = require "scenery"

local mm = 1e-3
local BASKET = { 0, 260 * mm }
-- The target's place and those of the distractors, in LIBERO's order; the target stands on the first or the second.
local NEAR, FAR = { 50 * mm, -100 * mm }, { -120 * mm, -240 * mm }
local OTHERS = { { -150 * mm, 60 * mm }, { 100 * mm, -200 * mm }, { 150 * mm, 30 * mm }, { -200 * mm, -80 * mm } }
-- Spread of start states: soft things are moved and turned, rigid ones keep LIBERO's regions.
local SOFT = { reach = 20 * mm, turn = math.rad(30) }
local RIGID = { reach = 25 * mm, turn = 0 }
local REGION = 10 * mm
-- Room between things, and around the target: for a finger with its sensor.
local ROOM, AROUND = 12 * mm, 20 * mm

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

-- `asset` among the distractors of the k-th task, where that task has its target.
local function layout(name, asset, k, spread)
  local task = TASKS[k] or error("there are ten arrangements", 3)
  local recipe, things = require("assets." .. asset), {}
  local function add(other, at, how)
    things[#things + 1] = { name = other, asset = require("assets." .. other), at = at, reach = how.reach, turn = how.turn }
  end
  add(asset, task.far and FAR or NEAR, spread)
  things[1].room, things[1].reachable = AROUND, true
  add(task[2], task.far and NEAR or FAR, RIGID)
  for i, at in ipairs(OTHERS) do add(task[i + 2], at, RIGID) end
  things[#things + 1] = { name = "basket", asset = basket, at = BASKET, reach = REGION }
  return softvt.layout(name, function(scene, rng)
    scene.base = { -0.6, 0, 0 }
    local camera = scene:camera "third_person"
    camera.position, camera.quat = { 0.8966, 0, 0.65 }, { 0.6182, 0.3432, 0.3432, 0.6182 }
    scene:add { name = "floor", asset = floor, xyz = { 0.75, 0, 0 } }
    arrange.add(scene, rng, things, ROOM)
    scenery.floor_room(scene)
    arrange.arm(scene, rng)
  end)
end

function layouts.rigid(k) return layout(("floor_%d"):format(k), TASKS[k][1], k, RIGID) end

function layouts.soft(asset, k) return layout(("floor_%d_%s"):format(k, asset), asset, k, SOFT) end

return layouts
