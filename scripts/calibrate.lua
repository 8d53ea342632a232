-- Calibrates soft assets by the protocol of the SoftVTBench paper (appendix C.3), with the expert's grasp.
--
-- Lower bound: the smallest closure, from loose to tight, at which five grasp–lift–hold trials succeed. Trials are displaced by
-- up to 5 mm and 10°. Upper bound: the settled object is squeezed in place, step by step. D_ref is the largest stable
-- deformation, and τ = κ D_ref. A second squeeze between the last stable and the first unstable step uses steps an eighth as
-- large, so that D_ref does not depend on the step.
--
--   softvt scripts/calibrate.lua --asset spiral_roll,sesame_bun
--
-- Writes assets/calibration/<asset>.json, the rows of the sweep in SoftVTBench's fields, the plot of the envelope, and
-- scripts/calibrated.lua. If all standard assets are calibrated, it also writes docs/calibration.md with all plots.
local calibration_page = require "calibration_page"
local grasp = require "experts.grasp"
local known = require "calibrated"
local soft_assets = require("asset_names").soft
local table_top = require "assets.table"

local opt = softvt.options {
  asset = { default = soft_assets, help = "assets to calibrate" },
  step = { default = 0.02, min = 0.002, max = 0.2, help = "step of the closure" },
  trials = { default = 5, integer = true, min = 1, max = 100, help = "hold trials at each closure" },
  hold_s = { default = 2, unit = "s", min = 0.1, max = 60, help = "duration of a trial's hold" },
  kappa = { default = 0.5, min = 0.05, max = 1, help = "τ as a fraction of the largest stable deformation" },
}

-- Episodes use only files that were read when the plan was made, so every asset is required here.
local assets = {}
for _, name in ipairs(opt.asset) do assets[name] = require("assets." .. name) end

local OFFSET, TURN = 0.005, math.rad(10)  -- largest displacement of trials, m and rad
local LIFT, SLIP_MM = 0.10, 2             -- lift, m; slip that fails a trial, mm
local REST_S, REST_SPEED = 0.5, 0.005     -- duration and node speed of a squeeze at rest, s and m/s
local REST_TIMEOUT_S = 3                  -- largest time until a squeeze is at rest, s
local FINE = 8                            -- fine steps per step
local BEYOND = 3                          -- closures tried beyond the first that holds, for the plot
local CONTACT_N = 1e-3                    -- pad force that counts as contact, N

-- A layout of the object alone on the table. The displacement of a trial is drawn with the scene, so it depends only on the asset and
-- the index of the trial, not on the closure.
local function single_object(name, displacement)
  return softvt.layout("calibrate_" .. name, function(scene, rng)
    scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
    scene:add { name = "object", asset = assets[name], at = { -0.05, 0 } }
    if displacement then
      displacement.offset = { rng:uniform(-OFFSET, OFFSET), rng:uniform(-OFFSET, OFFSET) }
      displacement.turn = rng:uniform(-TURN, TURN)
    end
  end)
end

-- Grasps the object at a closure, as the expert does, displaced by `displacement`.
local function grasp_at(closure, displacement)
  return function(arm, scene)
    local object = scene:object "object"
    local height = grasp.height(object)
    local at = grasp.pose(object, height, displacement and displacement.offset, displacement and displacement.turn)
    arm:move_to(at:translated { 0, 0, 0.08 }, { speed = 0.6, angular_speed = 3 })
    arm:move_to(at, { speed = 0.25 })
    arm:wait(0.1)
    arm:grasp(closure, { rate = 0.6 })
    arm:wait(0.3)
  end
end

local function lift(arm) arm:move_by({ 0, 0, LIFT }, { speed = 0.25 }) end

-- The largest closure on the grid of steps at which the gels do not touch the object.
local function first_closure(name, step)
  local view
  softvt.simulate { layout = single_object(name) }:drive(function(arm, scene)
    view = scene:object "object"
    arm:wait(0.05)
  end)
  return math.floor((1 - grasp.width(view) / 0.08) / step) * step
end

-- Distance by which the object has fallen behind the tool since `before`, mm.
local function lag_mm(sim, before)
  local tool, seen = sim:tool(), sim:measure "object"
  return 1e3 * ((tool[3] - before.tool) - (seen.height_m - before.height))
end

local function heights(sim) return { tool = (sim:tool())[3], height = sim:measure "object".height_m } end

-- Grasp–lift–hold trial `k`. Returns whether it held, the slip (mm) and the peak D (%).
local function hold_trial(name, closure, k, hold_s)
  local displacement = {}
  local sim = softvt.simulate { layout = single_object(name, displacement), episode = k }
  local ok = sim:drive(grasp_at(closure, displacement))
  local before = heights(sim)
  ok = ok and sim:drive(lift)
  -- An object that was not lifted by now is not held.
  if ok and lag_mm(sim, before) < 0.5e3 * LIFT then ok = sim:wait(hold_s) end
  local slip = math.abs(lag_mm(sim, before))
  local seen = sim:measure "object"
  return { held = ok and slip <= SLIP_MM, slip_mm = slip, d_peak_pct = seen.d_peak_pct }
end

local function scan_holds(name, first, o)
  local rows, beyond = {}, 0
  local closure = first
  while closure <= 1 and beyond <= BEYOND do
    local row = { asset = name, kind = "hold", closure = closure, trials = o.trials, held = 0, slip_mm = 0, d_peak_pct = 0 }
    for k = 1, o.trials do
      local result = hold_trial(name, closure, k, o.hold_s)
      if result.held then row.held = row.held + 1 end
      row.slip_mm = math.max(row.slip_mm, result.slip_mm)
      row.d_peak_pct = math.max(row.d_peak_pct, result.d_peak_pct)
    end
    rows[#rows + 1] = row
    if row.held == row.trials then beyond = beyond + 1 end
    closure = closure + o.step
  end
  return rows
end

-- One step of a squeeze: closes further and waits until the object is at rest or the timeout passes. Speed, det F and contact of
-- a row are those of the last REST_S seconds.
local function squeeze(sim, name, closure)
  local row = { asset = name, kind = "sweep", closure = closure, stable = false }
  local ok, problem = sim:drive(function(arm) arm:close_to(closure, { rate = 0.2 }) end)
  local elapsed_s, resting_s = 0, 0
  while ok and resting_s < REST_S and elapsed_s < REST_TIMEOUT_S do
    ok, problem = sim:wait(0.05)
    elapsed_s = elapsed_s + 0.05
    local seen = sim:measure "object"
    local touching = math.min(table.unpack(seen.pad_force)) > CONTACT_N
    if resting_s == 0 then row.min_det_f, row.node_speed_m_s, row.both_pads = math.huge, 0, true end
    row.min_det_f = math.min(row.min_det_f, seen.min_det_f or 1)
    row.node_speed_m_s = math.max(row.node_speed_m_s, seen.speed)
    row.both_pads = row.both_pads and touching
    resting_s = seen.speed < REST_SPEED and resting_s + 0.05 or 0
  end
  if not ok then return nil, problem end
  local seen = sim:measure "object"
  row.gripper_width_mm = 1e3 * seen.width_m
  row.fingerprint = seen.fingerprint
  row.d_peak_pct = seen.d_peak_pct
  row.force_n = 0.5 * (seen.pad_force[1] + seen.pad_force[2])
  row.slip_mm = math.max(table.unpack(seen.slip_mm))
  row.stable = softvt.stable {
    closure = closure, gripper_width_mm = row.gripper_width_mm, d_peak_pct = row.d_peak_pct, force_n = row.force_n,
    min_det_f = row.min_det_f, node_speed_m_s = row.node_speed_m_s, both_pads = row.both_pads, slip_mm = row.slip_mm,
    stable = false,
  }
  return row
end

-- Squeezes from `first` in steps of `step` and appends the rows. Ends at the first unstable squeeze after a stable one, at a failed
-- physics step, or with the gripper closed. Returns the last stable closure, and true if an unstable one followed.
local function sweep(name, first, step, rows)
  local sim = softvt.simulate { layout = single_object(name) }
  sim:drive(grasp_at(first))
  local last
  local closure = first
  while closure <= 1 + 1e-9 do
    local row = squeeze(sim, name, math.min(closure, 1))
    if not row then return last, true end
    rows[#rows + 1] = row
    if row.stable then last = row.closure elseif last then return last, true end
    closure = closure + step
  end
  return last, false
end

-- The holds and the sweep of each asset are separate points, so that they run in parallel.
local function run(point, o)
  local name = point.asset
  local first = first_closure(name, o.step)
  if point.part == "hold" then return scan_holds(name, first, o) end
  local rows = {}
  local last, more = sweep(name, first, o.step, rows)
  if last and more then sweep(name, last + o.step / FINE, o.step / FINE, rows) end
  return rows
end

-- The rows of one kind, reduced to the fields of the envelope.
local function pick(rows, name, kind)
  local picked = {}
  for _, row in ipairs(rows) do
    if row.asset == name and row.kind == kind then
      local copy = {}
      for key, value in pairs(row) do copy[key] = value end
      copy.asset, copy.kind, copy.fingerprint = nil, nil, nil
      picked[#picked + 1] = copy
    end
  end
  return picked
end

local function library_of(closures)
  local lines = {
    "-- Calibrated closures per asset: the smallest that holds, and the one at which D equals τ.",
    "-- Written by scripts/calibrate.lua; experts close to a value in between.", "return {",
  }
  for name, c in pairs(closures) do
    lines[#lines + 1] = ("  %s = { lower = %.4f, at_tau = %.4f },"):format(name, c.lower, c.at_tau)
  end
  lines[#lines + 1] = "}\n"
  return table.concat(lines, "\n")
end

-- True if all standard assets are in `found`.
local function complete(found)
  for _, name in ipairs(soft_assets) do
    if not found[name] then return false end
  end
  return true
end

local function finish(rows, o)
  local files, text, closures, envelope_of = {}, {}, {}, {}
  for name, closure in pairs(known) do closures[name] = closure end
  for _, name in ipairs(o.asset) do
    local fingerprint
    for _, row in ipairs(rows) do
      if row.asset == name then fingerprint = row.fingerprint or fingerprint end
    end
    local found = softvt.envelope {
      asset = name, kappa = o.kappa, fingerprint = fingerprint,
      holds = pick(rows, name, "hold"), sweep = pick(rows, name, "sweep"),
    }
    files[("assets/calibration/%s.json"):format(name)] = found.json
    files[("assets/calibration/%s.sweep.jsonl"):format(name)] = found.sweep
    files[("assets/calibration/%s.txt"):format(name)] = found.text
    envelope_of[name] = found
    text[#text + 1] = found.text
    if found.d_ref then
      text[#text + 1] = ("τ at κ 0.3, 0.5, 0.7: %.3f, %.3f, %.3f %%\n"):format(
        0.3 * found.d_ref, 0.5 * found.d_ref, 0.7 * found.d_ref)
    end
    closures[name] = found.safe_window and { lower = found.lower, at_tau = found.closure_at_tau } or nil
  end
  files["scripts/calibrated.lua"] = library_of(closures)
  if complete(envelope_of) then files["docs/calibration.md"] = calibration_page(soft_assets, envelope_of) end
  return { text = table.concat(text, "\n"), files = files }
end

return softvt.experiment {
  name = "calibrate",
  options = opt,
  points = function(o)
    local points = {}
    for _, name in ipairs(o.asset) do
      for _, part in ipairs { "hold", "sweep" } do points[#points + 1] = { asset = name, part = part } end
    end
    return points
  end,
  run = run,
  finish = finish,
  columns = {
    "asset", "kind", "closure", "held", "trials", "stable", "gripper_width_mm", "d_peak_pct", "force_n", "min_det_f",
    "node_speed_m_s", "both_pads", "slip_mm",
  },
}
