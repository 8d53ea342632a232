-- Calibrates soft assets: the limit τ on D, and the safe window of widths between the gels.
--
--   softvt scripts/calibrate.lua --asset spiral_roll,sesame_bun
--   softvt scripts/calibrate.lua --asset spiral_roll --check-ends       trials with the robot's hand at both ends of the window
--   softvt scripts/calibrate.lua --asset spiral_roll --sweep-protocol hand    the sweep of the SoftVTBench paper instead
--
-- --sweep-protocol press (the default) tests the object alone, between two gel pads on rigid carriers (scripts/calibration/press.lua).
-- It closes in steps of the width until 5 % of the volume is beyond the stable strain of the material: the smaller of its
-- collapse_strain and damage_strain. D_ref is D at that width, interpolated, and τ = κ D_ref. A press that ends earlier is censored: the
-- file says why, and D_ref is a lower bound. The loose end of the window is the widest width at which five trials with the expert's
-- grasp hold while the pads lift; the tight end is the widest width at which D reaches τ in the press or in those trials.
--
-- --sweep-protocol hand is the sweep of the paper (appendix C.3) with the robot's hand (scripts/calibration/hand.lua): its D_ref is the
-- largest stable D up to a closed hand.
--
-- Writes assets/calibration/<asset>.json, the rows of the sweep, the plot and the text of the envelope, and scripts/calibrated.lua.
-- If all standard assets are calibrated, it also writes docs/calibration.md. With --scale, --resolution or --check-ends it measures only
-- and writes nothing.
local calibration_page = require "calibration_page"
local hand = require "calibration.hand"
local known = require "calibrated"
local press = require "calibration.press"
local soft_assets = require("asset_names").soft

local opt = softvt.options {
  asset = { default = soft_assets, help = "assets to calibrate" },
  sweep_protocol = { default = "press", choices = { "press", "hand" }, help = "press test of the object alone, or the paper's sweep with the robot's hand" },
  kappa = { default = 0.5, min = 0.05, max = 1, help = "τ as a fraction of D_ref" },
  step_mm = { default = 0.5, unit = "mm", min = 0.02, max = 5, help = "press: step of the width" },
  within_mm = { default = 0.02, unit = "mm", min = 0.005, max = 1, help = "press: accuracy of the loose end" },
  scale = { default = 1, min = 0.5, max = 2, help = "press: size of the object; measures only" },
  resolution = { default = 0, integer = true, min = 0, max = 64, help = "press: voxels along the longest edge; measures only (0: the asset's own)" },
  check_ends = { default = false, help = "run trials with the robot's hand 5 % inside and outside of the calibrated window; measures only" },
  trials = { default = 100, integer = true, min = 1, max = 1000, help = "hand: hold trials at each end with --check-ends (5 at each closure with --sweep-protocol hand)" },
  step = { default = 0.02, min = 0.002, max = 0.2, help = "hand: step of the closure" },
  hold_s = { default = 1, unit = "s", min = 0.1, max = 60, help = "hand: duration of a trial's hold" },
}

-- Episodes use only files that were read when the plan was made, so every asset is required here.
local assets = {}
for _, name in ipairs(opt.asset) do assets[name] = require("assets." .. name) end

local HAND_TRIALS = 5     -- trials at each closure of the paper's scan
local BATCH = 10          -- trials of a point of --check-ends
local END_SHARE = 0.05    -- distance from an end of the window, as a share of the window

local function append(rows, kind, name, found)
  for _, row in ipairs(found) do
    row.asset, row.kind = name, kind
    rows[#rows + 1] = row
  end
end

-- Rows of a press test: first the sweep, then holds between its contact and τ.
local function press_asset(name, o)
  local change = { scale = o.scale, resolution = o.resolution > 0 and o.resolution or nil }
  local asset, rows = assets[name], {}
  local sweep, ended = press.sweep(asset, 1e-3 * o.step_mm, change)
  append(rows, "sweep", name, sweep)
  local found = softvt.envelope {
    asset = name, kappa = o.kappa, stable_strain = press.stable_strain(asset.body), ended = ended, holds = {}, sweep = sweep,
  }
  local at_tau, contact = found.window.width_at_tau_mm, found.width_contact_mm
  if at_tau and contact then
    local narrowest = found.width_at_d_ref_mm
    local holds = press.loose_end(asset, 1e-3 * at_tau, 1e-3 * contact, 1e-3 * narrowest, 1e-3 * o.within_mm, change)
    press.carried_end(asset, holds, found.tau, change)
    append(rows, "hold", name, holds)
  end
  for _, row in ipairs(rows) do row.ended = ended end
  return rows
end

-- A batch of trials at an end of the window: `share` of the window inside of it, or outside if negative.
local function check_end(point, o)
  local window = known[point.asset]
  if not window then
    error(("calibrate: %s has no calibrated window; run softvt scripts/calibrate.lua --asset %s first"):format(point.asset, point.asset), 0)
  end
  local extent, rise = window.width_lower - window.width_at_tau, window.force_at_tau - window.force_lower
  local from = point.at == "loose" and 0 or 1
  local along = from + (point.at == "loose" and 1 or -1) * (point.side == "inside" and END_SHARE or -END_SHARE)
  local width, force = window.width_lower - along * extent, math.max(0, window.force_lower + along * rise)
  local closure = hand.closure_at(width, force)
  local held, d_peak_pct = hand.trials(assets[point.asset], closure, point.first, point.last, o.hold_s)
  return {
    asset = point.asset, kind = point.at .. " " .. point.side, width_mm = 1e3 * width, closure = closure,
    trials = point.last - point.first + 1, held = held, d_pct = d_peak_pct,
  }
end

local function run(point, o)
  if point.at then return check_end(point, o) end
  if o.sweep_protocol == "press" then return press_asset(point.asset, o) end
  local rows = {}
  if point.part == "hold" then
    append(rows, "hold", point.asset, hand.holds(assets[point.asset], o.step, HAND_TRIALS, o.hold_s))
  else
    append(rows, "sweep", point.asset, hand.sweep(assets[point.asset], o.step))
  end
  return rows
end

local function points(o)
  local list = {}
  for _, name in ipairs(o.asset) do
    if o.check_ends then
      for _, at in ipairs { "loose", "tight" } do
        for _, side in ipairs { "inside", "outside" } do
          for first = 1, o.trials, BATCH do
            list[#list + 1] = { asset = name, at = at, side = side, first = first, last = math.min(o.trials, first + BATCH - 1) }
          end
        end
      end
    elseif o.sweep_protocol == "press" then
      list[#list + 1] = { asset = name, part = "press" }
    else
      for _, part in ipairs { "hold", "sweep" } do list[#list + 1] = { asset = name, part = part } end
    end
  end
  return list
end

local ROW_FIELDS = {
  hold = { "width_mm", "closure", "trials", "held", "slip_mm", "d_peak_pct" },
  sweep = { "width_mm", "closure", "d_pct", "force_n", "strain_p95", "min_det_f", "node_speed_m_s", "both_pads", "slip_mm", "stable" },
}

-- The rows of one kind, reduced to the fields of the envelope, and why the sweep ended.
local function pick(rows, name, kind)
  local picked, ended = {}, nil
  for _, row in ipairs(rows) do
    if row.asset == name and row.kind == kind then
      local copy = {}
      for _, key in ipairs(ROW_FIELDS[kind]) do copy[key] = row[key] end
      picked[#picked + 1], ended = copy, row.ended
    end
  end
  return picked, ended
end

local function library_of(windows)
  local lines = {
    "-- Calibrated windows per asset: widths between the gels (m) at first contact, at the loose end and at τ, the forces per pad (N) at",
    "-- the two ends, and the share of τ that the object reaches by bending while it is carried. Written by scripts/calibrate.lua; experts",
    "-- grasp at a width in between.", "return {",
  }
  for name, w in pairs(windows) do
    lines[#lines + 1] = ("  %s = { width_contact = %.6f, width_lower = %.6f, width_at_tau = %.6f, force_lower = %.5f, force_at_tau = %.5f, bending = %.4f },"):format(
      name, w.width_contact, w.width_lower, w.width_at_tau, w.force_lower, w.force_at_tau, w.bending)
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

-- Why an asset has no safe window, with the mend; nil if it has one.
local function empty_window(name, found)
  local window = found.window
  if window.extent_mm then return nil end
  local tight = window.width_at_tau_mm and ("D passes τ at %.2f mm"):format(window.width_at_tau_mm) or "the sweep does not reach τ"
  local loose = window.width_lower_mm and ("friction carries it only from %.2f mm inward"):format(window.width_lower_mm)
    or "friction carries it at no width"
  return ("%s has no safe window: %s, and %s; give it more friction, less density, or a larger collapse_strain or damage_strain"):format(
    name, tight, loose)
end

local function three_kappas(found)
  if not found.d_ref then return "" end
  return ("τ at κ 0.3, 0.5, 0.7: %.3f, %.3f, %.3f %%\n"):format(0.3 * found.d_ref, 0.5 * found.d_ref, 0.7 * found.d_ref)
end

local function warnings(name, found)
  local text = ""
  if found.censored then
    text = ("warning: the press of %s is censored: %s. State collapse_strain in its softvt.soft.\n"):format(name, found.censored)
  end
  if found.carried_d and found.tau and found.carried_d > found.tau then
    text = text .. ("warning: carried, %s bends beyond τ at every width (D %.3f %% at least). Carry it slowly (the hint carry_pace), or make it shorter, stiffer or lighter.\n"):format(
      name, found.carried_d)
  end
  return text
end

-- Held trials per asset and end, over all batches.
local function ends_text(rows)
  local order, sums = {}, {}
  for _, row in ipairs(rows) do
    local key = row.asset .. " " .. row.kind
    if not sums[key] then
      order[#order + 1] = key
      sums[key] = { held = 0, trials = 0, d = 0 }
    end
    local sum = sums[key]
    sum.held, sum.trials, sum.d = sum.held + row.held, sum.trials + row.trials, math.max(sum.d, row.d_pct)
  end
  local lines = {}
  for _, key in ipairs(order) do
    local sum = sums[key]
    lines[#lines + 1] = ("%s: %d of %d held, largest D %.3f %%"):format(key, sum.held, sum.trials, sum.d)
  end
  return table.concat(lines, "\n") .. "\n"
end

local function finish(rows, o)
  if o.check_ends then return { text = ends_text(rows) } end
  local files, text, windows, envelope_of, empty = {}, {}, {}, {}, {}
  for name, window in pairs(known) do windows[name] = window end
  for _, name in ipairs(o.asset) do
    local sweep, ended = pick(rows, name, "sweep")
    local found = softvt.envelope {
      asset = name, protocol = o.sweep_protocol, kappa = o.kappa, fingerprint = softvt.fingerprint(assets[name]), ended = ended,
      stable_strain = o.sweep_protocol == "press" and press.stable_strain(assets[name].body) or nil,
      holds = pick(rows, name, "hold"), sweep = sweep,
    }
    local at = "assets/calibration/" .. name
    files[at .. ".json"], files[at .. ".sweep.jsonl"], files[at .. ".svg"], files[at .. ".txt"] = found.json, found.sweep, found.plot, found.text
    envelope_of[name] = found
    text[#text + 1] = found.text .. three_kappas(found) .. warnings(name, found)
    empty[#empty + 1] = empty_window(name, found)
    local window = found.window
    windows[name] = window.extent_mm and {
      width_contact = 1e-3 * found.width_contact_mm, width_lower = 1e-3 * window.width_lower_mm,
      width_at_tau = 1e-3 * window.width_at_tau_mm, force_lower = window.force_lower_n, force_at_tau = window.force_at_tau_n,
      bending = found.carried_d and found.carried_d / found.tau or 0,
    } or nil
  end
  text = table.concat(text, "\n")
  if o.scale ~= 1 or o.resolution > 0 then return { text = text } end
  if #empty > 0 then error("calibrate: " .. table.concat(empty, "\n"), 0) end
  files["scripts/calibrated.lua"] = library_of(windows)
  if complete(envelope_of) then files["docs/calibration.md"] = calibration_page(soft_assets, envelope_of) end
  return { text = text, files = files }
end

return softvt.experiment {
  name = "calibrate",
  options = opt,
  points = points,
  run = run,
  finish = finish,
  columns = {
    "asset", "kind", "width_mm", "closure", "held", "trials", "d_peak_pct", "stable", "d_pct", "force_n", "strain_p95", "min_det_f", "node_speed_m_s",
    "both_pads", "slip_mm",
  },
}
