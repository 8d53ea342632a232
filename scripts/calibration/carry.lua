-- Carrying trials of one instance of an asset by the robot's hand: the grasp of the expert of the hidden suites, its
-- lift and its transport.
local grasp = require "experts.grasp"
local table_top = require "assets.table"
local trial = require "calibration.trial"

local carry = {}

-- Height of the lift, distance of the transport along the table and of the way down, m, and largest speeds of the way
-- up and down and of the transport, m/s: those of pick_place at its largest pace.
local LIFT, ALONG, DOWN, SPEED, FAST = trial.LIFT, 0.2, 0.04, trial.SPEED, 0.28
-- Closing speed in contact, m/s.
local CLOSING_SPEED = 0.003
-- Steps of a bisection, and the range of forces in which it looks for each end, as factors on that of the window.
local STEPS, RANGE = 5, 1.5

-- A layout of the instance alone on the table. The displacement of the grasp is drawn with the scene, so it depends
-- only on the asset and the index of the trial.
local function single_object(asset, one, displacement)
  return softvt.layout("carry_" .. asset.name, function(scene, rng)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "object", asset = asset, at = { -0.05, -0.1 } }
    local object = scene:object "object"
    object.scale, object.coating = one.scale, one.coating
    object.youngs_pa, object.density = one.youngs_factor * object.youngs_pa, one.density_factor * object.density
    displacement[1], displacement[2] =
      rng:uniform(-grasp.SPREAD, grasp.SPREAD), rng:uniform(-grasp.SPREAD, grasp.SPREAD)
  end)
end

-- Trial `k`, which closes until the pads press with `force` (N) on average. Returns whether the object was carried
-- without slip, its peak D (%) and the mean force on the pads before the lift (N).
local function carried(asset, one, force, k)
  local displacement = {}
  local sim = softvt.simulate { layout = single_object(asset, one, displacement), episode = k }
  local ok = trial.drive(sim, function(arm, scene)
    local object = scene:object "object"
    local at = grasp.pose(object, grasp.height(object), displacement)
    arm:move_to(at:translated { 0, 0, 0.08 }, { speed = 0.6, angular_speed = 3 })
    arm:move_to(at, { speed = 0.25 })
    arm:wait(0.1)
    grasp.close(arm, object, { width = 0, force = force }, { closing_speed = CLOSING_SPEED, stop = "touch" })
    arm:wait(0.3)
  end)
  local before, height = sim:measure "object", sim:tool()[3]
  ok = ok
    and trial.drive(sim, function(arm, scene)
      local pace = grasp.carry_pace(scene:object "object")
      arm:move_by({ 0, 0, LIFT }, { speed = SPEED * pace })
      arm:move_by({ 0, ALONG, 0 }, { speed = FAST * pace })
      arm:move_by({ 0, 0, -DOWN }, { speed = SPEED * pace })
    end)
  local after = sim:measure "object"
  local slip_mm = math.max(after.slip_mm[1] - before.slip_mm[1], after.slip_mm[2] - before.slip_mm[2])
  local fallen_mm = 1e3 * ((sim:tool()[3] - height) - (after.height_m - before.height_m))
  local is_carried = ok and math.max(slip_mm, fallen_mm) <= trial.SLIP_MM
  return is_carried, after.d_peak_pct, 0.5 * (before.pad_force[1] + before.pad_force[2])
end

-- Bisects the commanded force (N) between `no` and `yes`; `try(force)` returns whether it will do and the force of the
-- pads. Returns the force of the pads nearest to the change that will do; nil if the change is not between them.
local function bisect(no, yes, try)
  local will_do, found = try(yes)
  if not will_do or try(no) then return nil end
  for _ = 1, STEPS do
    local middle = math.sqrt(no * yes)
    local is_yes, pads = try(middle)
    if is_yes then
      yes, found = middle, pads
    else
      no = middle
    end
  end
  return found
end

-- Measures the window of an instance in the hand: the least force per pad that carries it without slip, and the largest
-- with which its peak D stays within τ (N), each with the grasp of trial `k`. An end is nil if it is not near that of
-- `window`.
function carry.ends(asset, one, window, k)
  local loose, tight = window.loose.force, window.tight.force
  local function holds(force)
    local ok, _, pads = carried(asset, one, force, k)
    return ok, pads
  end
  local function is_gentle(force)
    local _, d_peak_pct, pads = carried(asset, one, force, k)
    return d_peak_pct <= window.tau, pads
  end
  return bisect(loose / RANGE, loose * RANGE, holds), bisect(tight * RANGE, tight / RANGE, is_gentle)
end

return carry
