-- Calibrates soft assets after the SoftVTBench paper (appendix C.3), with the expert's own grasp.
--
-- Lower bound: closures from loose to tight, each tried in five grasp–lift–hold trials that miss the middle by up to 5 mm
-- and 10°; the smallest closure at which all hold. Upper bound: the settled object is squeezed where it lies, step by
-- step; D_ref is the largest stable deformation and τ = κ D_ref. Between the last stable step and the first that is
-- not, a second squeeze goes in steps an eighth as large, so that D_ref does not hang on the step.
--
--   softvt scripts/calibrate.lua --asset spiral_roll,sesame_bun
--
-- Writes assets/calibration/<asset>.json, the sweep rows in SoftVTBench's fields and the envelope's plot beside it, and
-- scripts/calibrated.lua; where all standard assets are calibrated, docs/calibration.md too, which shows all plots.
local envelopes = require "envelopes"
local grasp = require "experts.grasp"
local known = require "calibrated"
local soft_assets = require("asset_names").soft
local table_top = require "assets.table"

local opt = softvt.options {
  asset = { default = soft_assets, help = "assets to calibrate" },
  step = { default = 0.02, min = 0.002, max = 0.2, help = "step of the closure" },
  trials = { default = 5, integer = true, min = 1, max = 100, help = "hold trials at each closure" },
  hold_s = { default = 2, unit = "s", min = 0.1, max = 60, help = "how long a trial holds" },
  kappa = { default = 0.5, min = 0.05, max = 1, help = "share of the largest stable deformation that is safe" },
}

-- Files are served from here on by name, so every asset is read when the plan is made.
local assets = {}
for _, name in ipairs(opt.asset) do assets[name] = require("assets." .. name) end

local OFFSET, TURN = 0.005, math.rad(10)  -- how far trials miss the middle
local LIFT, SLIP_MM = 0.10, 2             -- m; mm of slip that fails a trial
local QUIET_S, QUIET_SPEED = 0.5, 0.005   -- s and m/s of a squeeze at rest
local PATIENCE_S = 3                      -- s that a squeeze may take to come to rest
local FINE = 8                            -- fine steps in one step
local BEYOND = 3                          -- closures tried beyond the first that holds, for the plot
local TOUCH_N = 1e-3

-- The object alone on the table. A trial's `miss` is drawn with the scene, so that it depends on the asset and the number
-- of the trial alone: closures differ by nothing else.
local function alone(name, miss)
  return softvt.layout("calibrate_" .. name, function(scene, rng)
    scene:add { name = "table", asset = table_top, xyz = { 0, 0, 0 } }
    scene:add { name = "object", asset = assets[name], at = { -0.05, 0 } }
    if miss then
      miss.offset = { rng:uniform(-OFFSET, OFFSET), rng:uniform(-OFFSET, OFFSET) }
      miss.turn = rng:uniform(-TURN, TURN)
    end
  end)
end

-- Takes the object at a closure, as the expert does; `miss` displaces the grasp.
local function take(closure, miss)
  return function(arm, scene)
    local object = scene:object "object"
    local height = grasp.height(object)
    local at = grasp.pose(object, height, miss and miss.offset, miss and miss.turn)
    arm:move_to(at:moved { 0, 0, 0.08 }, { speed = 0.6, turn = 3 })
    arm:move_to(at, { speed = 0.25 })
    arm:wait(0.1)
    arm:grasp(closure, { rate = 0.6 })
    arm:wait(0.3)
  end
end

local function lift(arm) arm:move_by({ 0, 0, LIFT }, { speed = 0.25 }) end

-- The closure at which the gels are a step away from touching an object, on the grid of steps.
local function loose(name, step)
  local view
  softvt.simulate { layout = alone(name) }:drive(function(arm, scene)
    view = scene:object "object"
    arm:wait(0.05)
  end)
  return math.floor((1 - grasp.width(view) / 0.08) / step) * step
end

-- How far the object has fallen behind the tool since `before`, mm.
local function lag_mm(sim, before)
  local tool, seen = sim:tool(), sim:watch "object"
  return 1e3 * ((tool[3] - before.tool) - (seen.height_m - before.height))
end

local function mark(sim) return { tool = (sim:tool())[3], height = sim:watch "object".height_m } end

-- Grasp–lift–hold trial number `k`: whether it held, how far the object slipped (mm) and its peak D (%).
local function trial(name, closure, k, hold_s)
  local miss = {}
  local sim = softvt.simulate { layout = alone(name, miss), episode = k }
  local ok = sim:drive(take(closure, miss))
  local before = mark(sim)
  ok = ok and sim:drive(lift)
  -- What has not come along by now never will.
  if ok and lag_mm(sim, before) < 0.5e3 * LIFT then ok = sim:wait(hold_s) end
  local slip = math.abs(lag_mm(sim, before))
  local seen = sim:watch "object"
  return { held = ok and slip <= SLIP_MM, slip_mm = slip, d_peak_pct = seen.d_peak_pct }
end

local function scan_holds(name, first, o)
  local rows, beyond = {}, 0
  local closure = first
  while closure <= 1 and beyond <= BEYOND do
    local row = { asset = name, kind = "hold", closure = closure, trials = o.trials, held = 0, slip_mm = 0, d_peak_pct = 0 }
    for k = 1, o.trials do
      local result = trial(name, closure, k, o.hold_s)
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

-- One closure of a squeeze: closes on and waits until it has been quiet for long enough, or for as long as it may take.
-- What a row says of speed, det F and contact is of the last QUIET_S seconds.
local function squeeze(sim, name, closure)
  local row = { asset = name, kind = "sweep", closure = closure, stable = false }
  local ok, problem = sim:drive(function(arm) arm:close_to(closure, { rate = 0.2 }) end)
  local waited, quiet = 0, 0
  while ok and quiet < QUIET_S and waited < PATIENCE_S do
    ok, problem = sim:wait(0.05)
    waited = waited + 0.05
    local seen = sim:watch "object"
    local touching = math.min(table.unpack(seen.pad_force)) > TOUCH_N
    if quiet == 0 then row.min_det_f, row.node_speed_m_s, row.both_pads = math.huge, 0, true end
    row.min_det_f = math.min(row.min_det_f, seen.min_det_f or 1)
    row.node_speed_m_s = math.max(row.node_speed_m_s, seen.speed)
    row.both_pads = row.both_pads and touching
    quiet = seen.speed < QUIET_SPEED and quiet + 0.05 or 0
  end
  if not ok then return nil, problem end
  local seen = sim:watch "object"
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

-- Squeezes from `first` on by `step` and adds the rows, until a squeeze that was stable is so no more (or the physics
-- gives up, or the gripper is shut); gives the last stable closure and whether something came after it.
local function sweep(name, first, step, rows)
  local sim = softvt.simulate { layout = alone(name) }
  sim:drive(take(first))
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

-- A point is one half of an asset's calibration, so that halves and assets run side by side.
local function run(point, o)
  local name = point.asset
  local first = loose(name, o.step)
  if point.part == "hold" then return scan_holds(name, first, o) end
  local rows = {}
  local last, more = sweep(name, first, o.step, rows)
  if last and more then sweep(name, last + o.step / FINE, o.step / FINE, rows) end
  return rows
end

-- The rows of one kind without what the envelope does not know.
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
    "-- Closures that a calibration found, by asset: the smallest that holds, and the one that deforms by τ.",
    "-- Written by scripts/calibrate.lua; the experts close in between.", "return {",
  }
  for name, c in pairs(closures) do
    lines[#lines + 1] = ("  %s = { lower = %.4f, at_tau = %.4f },"):format(name, c.lower, c.at_tau)
  end
  lines[#lines + 1] = "}\n"
  return table.concat(lines, "\n")
end

-- Whether all standard assets are among `found`.
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
  if complete(envelope_of) then files["docs/calibration.md"] = envelopes(soft_assets, envelope_of) end
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
