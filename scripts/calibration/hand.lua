-- Squeezes and hold trials of one soft object by the robot's hand, with the expert's grasp: the protocol of the
-- SoftVTBench paper (appendix C.3), and trials that check the ends of a window found by another protocol.
local grasp = require "experts.grasp"
local table_top = require "assets.table"
local trial = require "calibration.trial"

local hand = {}

-- Displacement of a grasp, up to `offset` (m) and `turn` (rad), and height (m) and speed (m/s) of the lift: the
-- expert's lift with an offset, and the paper's trials.
local function expert(offset) return { offset = offset, turn = 0, lift = trial.LIFT, speed = trial.SPEED } end
local PAPER = { offset = 0.005, turn = math.rad(10), lift = 0.10, speed = 0.25 }
local REST_S, REST_SPEED = 0.5, 0.005 -- duration and node speed of a squeeze at rest, s and m/s
local REST_TIMEOUT_S = 3 -- largest time until a squeeze is at rest, s
local FINE = 8 -- fine steps per step
local BEYOND = 3 -- closures tried beyond the first that holds

-- A layout of the object alone on the table. The displacement of a trial, up to `offset` (m) and `turn` (rad), is drawn
-- with the scene, so it depends only on the asset and the index of the trial.
local function single_object(asset, displacement, offset, turn)
  return softvt.layout("calibrate_" .. asset.name, function(scene, rng)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "object", asset = asset, at = { -0.05, 0 } }
    if displacement then
      displacement.offset = { rng:uniform(-offset, offset), rng:uniform(-offset, offset) }
      displacement.turn = rng:uniform(-turn, turn)
    end
  end)
end

-- Grasps the object at a closure, as the expert does, displaced by `displacement`.
local function grasp_at(closure, displacement)
  return function(arm, scene)
    local object = scene:object "object"
    local at =
      grasp.pose(object, grasp.height(object), displacement and displacement.offset, displacement and displacement.turn)
    arm:move_to(at:translated { 0, 0, 0.08 }, { speed = 0.6, angular_speed = 3 })
    arm:move_to(at, { speed = 0.25 })
    arm:wait(0.1)
    arm:grasp(closure, { rate = 0.6 })
    arm:wait(0.3)
  end
end

-- The largest closure on the grid of steps at which the gels do not touch the object.
local function first_closure(asset, step)
  local view
  softvt.simulate { layout = single_object(asset) }:drive(function(arm, scene)
    view = scene:object "object"
    arm:wait(0.05)
  end)
  return math.floor(grasp.clear_closure(view, 0) / step) * step
end

-- Distance by which the object has fallen behind the tool since `before`, mm.
local function lag_mm(sim, before)
  local tool, seen = sim:tool(), sim:measure "object"
  return 1e3 * ((tool[3] - before.tool) - (seen.height_m - before.height))
end

local function heights(sim) return { tool = (sim:tool())[3], height = sim:measure "object".height_m } end

-- Grasp–lift–hold trial `k`. Returns whether it held, the slip (mm), the peak D (%) and the width (mm) after the grasp.
local function hold_trial(asset, closure, k, how, hold_s)
  local displacement = {}
  local sim = softvt.simulate { layout = single_object(asset, displacement, how.offset, how.turn), episode = k }
  local ok, pace = trial.drive(sim, grasp_at(closure, displacement)), grasp.carry_pace(asset)
  local width_mm, before = 1e3 * sim:measure "object".width_m, heights(sim)
  ok = ok and trial.drive(sim, function(arm) arm:move_by({ 0, 0, how.lift }, { speed = how.speed * pace }) end)
  -- An object that was not lifted by now is not held.
  if ok and lag_mm(sim, before) < 0.5e3 * how.lift then ok = sim:wait(hold_s) end
  local slip = math.abs(lag_mm(sim, before))
  return {
    held = ok and slip <= trial.SLIP_MM,
    slip_mm = slip,
    d_peak_pct = sim:measure "object".d_peak_pct,
    width_mm = width_mm,
  }
end

-- Trials `first` to `last` of a grip { width, force } with the expert's lift, displaced by up to `offset` (m) in each
-- horizontal direction. Returns the number that held, the largest peak D (%) and the mean width of the gels (mm).
function hand.trials(asset, grip, first, last, offset, hold_s)
  local closure, how, held, d_peak_pct, width_mm = grasp.command(grip), expert(offset), 0, 0, 0
  for k = first, last do
    local result = hold_trial(asset, closure, k, how, hold_s)
    if result.held then held = held + 1 end
    d_peak_pct, width_mm = math.max(d_peak_pct, result.d_peak_pct), width_mm + result.width_mm / (last - first + 1)
  end
  return held, d_peak_pct, width_mm
end

-- Hold trials from loose to tight in steps of `step` of the closure; the paper's scan for the lower bound.
function hand.holds(asset, step, trials, hold_s)
  local rows, beyond, closure = {}, 0, first_closure(asset, step)
  while closure <= 1 and beyond <= BEYOND do
    local row = { closure = closure, trials = trials, held = 0, slip_mm = 0, width_mm = 0 }
    for k = 1, trials do
      local result = hold_trial(asset, closure, k, PAPER, hold_s)
      if result.held then row.held = row.held + 1 end
      row.slip_mm, row.width_mm = math.max(row.slip_mm, result.slip_mm), row.width_mm + result.width_mm / trials
    end
    rows[#rows + 1] = row
    if row.held == row.trials then beyond = beyond + 1 end
    closure = closure + step
  end
  return rows
end

-- One step of a squeeze: closes further and waits until the object is at rest or the timeout passes. Speed, det F and
-- contact of a row are those of the last REST_S seconds.
local function squeeze(sim, closure)
  local row = { closure = closure, stable = false }
  local ok = trial.drive(sim, function(arm) arm:close_to(closure, { rate = 0.2 }) end)
  local elapsed_s, resting_s = 0, 0
  while ok and resting_s < REST_S and elapsed_s < REST_TIMEOUT_S do
    ok = sim:wait(0.05)
    elapsed_s = elapsed_s + 0.05
    local seen = sim:measure "object"
    local touching = math.min(table.unpack(seen.pad_force)) > trial.CONTACT_N
    if resting_s == 0 then
      row.min_det_f, row.node_speed_m_s, row.both_pads = math.huge, 0, true
    end
    row.min_det_f = math.min(row.min_det_f, seen.min_det_f or 1)
    row.node_speed_m_s = math.max(row.node_speed_m_s, seen.speed)
    row.both_pads = row.both_pads and touching
    resting_s = seen.speed < REST_SPEED and resting_s + 0.05 or 0
  end
  if not ok then return nil end
  local seen = sim:measure "object"
  row.width_mm, row.d_pct, row.d_v1_pct = 1e3 * seen.width_m, seen.d_peak_pct, seen.d_peak_v1_pct
  row.force_n = 0.5 * (seen.pad_force[1] + seen.pad_force[2])
  row.slip_mm = math.max(table.unpack(seen.slip_mm))
  row.stable = softvt.stable(row)
  return row
end

-- Squeezes from `first` in steps of `step` and appends the rows. Ends at the first unstable squeeze after a stable one,
-- at a failed physics step, or with the gripper closed. Returns the last stable closure, and true if an unstable one
-- followed.
local function squeeze_from(asset, first, step, rows)
  local sim = softvt.simulate { layout = single_object(asset) }
  trial.drive(sim, grasp_at(first))
  local closure, last = first, nil
  while closure <= 1 + 1e-9 do
    local row = squeeze(sim, math.min(closure, 1))
    if not row then return last, true end
    rows[#rows + 1] = row
    if row.stable then
      last = row.closure
    elseif last then
      return last, true
    end
    closure = closure + step
  end
  return last, false
end

-- The paper's sweep; a second one between the last stable and the first unstable closure has steps an eighth as large.
function hand.sweep(asset, step)
  local rows = {}
  local last, more = squeeze_from(asset, first_closure(asset, step), step, rows)
  if last and more then squeeze_from(asset, last + step / FINE, step / FINE, rows) end
  return rows
end

return hand
