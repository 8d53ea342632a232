-- Calibrates soft assets: the limit τ on D, and the safe window of widths between the gels.
--
--   softvt scripts/calibrate.lua --asset spiral_roll,sesame_bun
--   softvt scripts/calibrate.lua --asset spiral_roll --sweep-protocol hand --out hand_sweep    as in SoftVTBench
--
-- --sweep-protocol press (the default) tests the object alone, between two gel pads on rigid carriers
-- (scripts/calibration/press.lua). It closes in steps of the width until 5 % of the volume is beyond the stable strain
-- of the material: the smaller of its collapse_strain and damage_strain. Strains are averaged over 4 mm and found on a
-- mesh with voxels no larger than that, and at least 18 along the longest edge. D_ref is D at that width, interpolated,
-- and τ = κ D_ref. A press that ends earlier is censored: the file says why, and D_ref is a lower bound. The loose end
-- of the window is the widest width at which five trials with the expert's grasp hold while the pads lift; the tight
-- end is the widest width at which D reaches τ in the press or in those trials.
--
-- --sweep-protocol hand is the sweep of the paper (appendix C.3) with the robot's hand (scripts/calibration/hand.lua):
-- its D_ref is the largest stable D up to a closed hand.
--
-- The press is repeated at other sizes and stiffnesses, from which limits and windows of instances follow
-- (softvt.grip_window).
--
-- Writes assets/calibration/<asset>.json, the rows of the sweep, the plot and the text of the envelope. If all standard
-- assets are calibrated, it also writes docs/calibration.md. scripts/check_calibration.lua checks the results.
--
-- Writes assets/draws/<asset>.json, by which hidden instances are drawn, for an asset that has none: the first
-- calibration makes an asset drawable, and later ones change no draw.
local asset_names = require "asset_names"
local calibration_page = require "calibration_page"
local hand = require "calibration.hand"
local press = require "calibration.press"
local soft_asset = require "calibration.soft_asset"

local PRESS, HAND = { sweep_protocol = "press" }, { sweep_protocol = "hand" }
local opt = softvt.options {
  asset = { default = asset_names.soft, help = "assets to calibrate" },
  sweep_protocol = {
    default = "press",
    choices = { "press", "hand" },
    needs_out = true,
    help = "press test of the object alone, or the paper's sweep with the robot's hand",
  },
  kappa = { default = 0.5, min = 0.05, max = 1, needs_out = true, help = "τ as a fraction of D_ref" },
  step_mm = {
    default = 0.5,
    unit = "mm",
    min = 0.02,
    max = 5,
    only_with = PRESS,
    help = "step of the width; 5 mm change τ by a few per cent",
  },
  within_mm = {
    default = 0.02,
    unit = "mm",
    min = 0.01,
    max = 1,
    only_with = PRESS,
    help = "accuracy of the loose end",
  },
  step = { default = 0.02, min = 0.002, max = 0.2, only_with = HAND, help = "step of the closure" },
  trials = { default = 5, integer = true, min = 1, max = 1000, only_with = HAND, help = "hold trials at each closure" },
  hold_s = { default = 1, unit = "s", min = 0.1, max = 60, only_with = HAND, help = "duration of a trial's hold" },
}

-- Episodes use only files that were read when the plan was made, so every asset is required here.
local assets = {}
for _, name in ipairs(opt.asset) do
  assets[name] = soft_asset("calibrate", name, assets)
end

-- Presses of each asset for its instances, with half of the step: at the stiffnesses and at the sizes between which the
-- standard variations draw.
local STIFFNESSES, SIZES = { 1, 0.3, 3, 10, 30 }, { 0.88, 1.12 }

-- The rows of one variant, as softvt.envelope takes them.
local function variant_rows(rows)
  local kept = {}
  for k, row in ipairs(rows) do
    kept[k] = { width_mm = row.width_mm, d_pct = row.d_pct, force_n = row.force_n, strain_p95 = row.strain_p95 }
  end
  return kept
end

-- The envelope of rows of the kinds "sweep", "hold", "variant" and "end" (why the sweep ended) of one asset.
local function envelope(name, rows, o)
  local of = { sweep = {}, hold = {}, variant = {}, ["end"] = {} }
  for _, row in ipairs(rows) do
    if row.asset == name then table.insert(of[row.kind], row) end
  end
  local holds, sweep, last, variants = of.hold, of.sweep, of["end"][1] or {}, {}
  local function add_variant(scale, youngs)
    local found = {}
    for _, row in ipairs(of.variant) do
      if row.scale == scale and row.youngs_factor == youngs then found[#found + 1] = row end
    end
    if #found > 0 then
      variants[#variants + 1] = { scale = scale, youngs_factor = youngs, rows = variant_rows(found) }
    end
  end
  for _, youngs in ipairs(STIFFNESSES) do
    add_variant(1, youngs)
  end
  for _, scale in ipairs(SIZES) do
    add_variant(scale, 1)
  end
  return softvt.envelope {
    asset = name,
    protocol = o.sweep_protocol,
    kappa = o.kappa,
    fingerprint = softvt.fingerprint(assets[name]),
    ended = last.ended,
    stable_strain = last.stable_strain,
    holds = holds,
    sweep = sweep,
    variants = variants,
  }
end

local function append(rows, kind, name, found)
  for _, row in ipairs(found) do
    row.asset, row.kind = name, kind
    rows[#rows + 1] = row
  end
end

-- Appends the rows of the press of a variant.
local function append_variant(rows, name, scale, youngs, o, strains)
  local stable = {}
  local change = { scale = scale, youngs_factor = youngs }
  for _, row in ipairs(press.sweep(assets[name], 0.5e-3 * o.step_mm, change, strains).rows) do
    row.scale, row.youngs_factor = scale, youngs
    if row.stable then stable[#stable + 1] = row end
  end
  append(rows, "variant", name, stable)
end

-- Tells at the start of a press, which takes minutes, what its result will lack.
local function tell_doubts(asset)
  for _, warning in ipairs(softvt.asset_warnings(asset)) do
    print(("warning: asset %s: %s"):format(asset.name, warning))
  end
  if not (asset.body.collapse_strain or asset.body.damage_strain) then
    print(
      ("warning: asset %s: its softvt.soft has neither collapse_strain nor damage_strain, so that D_ref says where the press ends, not what the material bears"):format(
        asset.name
      )
    )
  end
end

-- Rows of a press test: the sweep, holds between its contact and τ, and presses at other stiffnesses.
local function press_asset(name, o)
  local asset, rows = assets[name], {}
  tell_doubts(asset)
  local strains = press.strains(asset)
  local sweep = press.sweep(asset, 1e-3 * o.step_mm, nil, strains)
  append(rows, "sweep", name, sweep.rows)
  append(rows, "end", name, { { ended = sweep.ended, stable_strain = sweep.stable_strain, tilt_deg = sweep.tilt_deg } })
  local found = envelope(name, rows, o)
  local at_tau, contact = found.window.tight.width_mm, found.width_contact_mm
  if at_tau and contact then
    local holds =
      press.loose_end(asset, 1e-3 * at_tau, 1e-3 * contact, 1e-3 * found.width_at_d_ref_mm, 1e-3 * o.within_mm)
    press.carried_end(asset, holds, found.tau)
    append(rows, "hold", name, holds)
  end
  for _, youngs in ipairs(STIFFNESSES) do
    append_variant(rows, name, 1, youngs, o, strains)
  end
  return rows
end

local function run(point, o)
  local rows, asset = {}, assets[point.asset]
  if point.part == "press" then
    return press_asset(point.asset, o)
  elseif point.part == "variant" then
    append_variant(rows, point.asset, point.scale, 1, o)
  elseif point.part == "hold" then
    append(rows, "hold", point.asset, hand.holds(asset, o.step, o.trials, o.hold_s))
  else
    append(rows, "sweep", point.asset, hand.sweep(asset, o.step))
  end
  return rows
end

local function points(o)
  local list = {}
  for _, name in ipairs(o.asset) do
    for _, part in ipairs(o.sweep_protocol == "press" and { "press" } or { "hold", "sweep" }) do
      list[#list + 1] = { asset = name, part = part }
    end
    for _, scale in ipairs(o.sweep_protocol == "press" and SIZES or {}) do
      list[#list + 1] = { asset = name, part = "variant", scale = scale }
    end
  end
  return list
end

local function three_kappas(found)
  if not found.d_ref then return "" end
  return ("τ at κ 0.3, 0.5, 0.7: %.3f, %.3f, %.3f %%\n"):format(
    0.3 * found.d_ref,
    0.5 * found.d_ref,
    0.7 * found.d_ref
  )
end

local function warnings(name, found)
  local text = ""
  if found.censored then
    local remedy = found.stable_strain and "" or " State collapse_strain in its softvt.soft."
    text = ("warning: the press of %s is censored: %s.%s\n"):format(name, found.censored, remedy)
  end
  if found.carried_d and found.tau and found.carried_d > found.tau then
    text = text
      .. ("warning: D of the carried %s exceeds τ at every width (%.3f %% at least). Carry it slowly (the hint carry_pace), or make it stiffer, lighter or, if it bends, shorter.\n"):format(
        name,
        found.carried_d
      )
  end
  return text
end

-- Limits below this are shown as 0, %.
local LEAST_TAU = 0.0005

-- Why the limit of an asset is no result; nil if it is one.
local function no_limit(name, found)
  if not found.tau or found.tau >= LEAST_TAU then return nil end
  local cause = "it is too stiff to be deformed; check youngs_pa, in Pa, or use softvt.rigid"
  for _, warning in ipairs(softvt.asset_warnings(assets[name])) do
    if warning:find "youngs_pa: " then cause = warning end
  end
  return ("%s: τ is %.2g %%, below what the simulation resolves: %s; no file of it is written"):format(
    name,
    found.tau,
    cause
  )
end

-- Tilt from which on an object has fallen over, degrees.
local FALLEN = 45

-- How an asset has settled otherwise than modelled; nil if it has not.
local function tilted(rows, name)
  for _, row in ipairs(rows) do
    if row.asset == name and row.tilt_deg then
      local verb = row.tilt_deg < FALLEN and "tilts" or "falls over"
      return ("it %s by %.0f° when it settles, and was pressed as it lies"):format(verb, row.tilt_deg)
    end
  end
end

-- Why an asset has no window, from the first line of its envelope and how it has tilted.
local function problem_of(found, tilt)
  local line = found.text:match "[^\n]*"
  if found.censored then line = ("%s (the press ended early: %s)"):format(line, found.censored) end
  if tilt then return ("%s: %s; model it as it comes to rest"):format(line, tilt) end
  if found.censored then return line end
  return line .. "; give it more friction, less density, or a larger collapse_strain or damage_strain"
end

local function finish(rows, o)
  local files, text, found, problems, unusable = {}, {}, {}, {}, {}
  for _, name in ipairs(o.asset) do
    local one = envelope(name, rows, o)
    text[#text + 1] = one.text .. three_kappas(one) .. warnings(name, one)
    local unresolved = no_limit(name, one)
    if unresolved then
      unusable[#unusable + 1] = "calibrate: " .. unresolved
    else
      local at = "assets/calibration/" .. name
      files[at .. ".json"], files[at .. ".sweep.jsonl"], files[at .. ".svg"], files[at .. ".txt"] =
        one.json, one.sweep, one.plot, one.text
      files["assets/draws/" .. name .. ".json"] = softvt.draw_reference(assets[name], one.json)
      found[name] = one
      if not one.window.extent_mm then problems[#problems + 1] = problem_of(one, tilted(rows, name)) end
    end
  end
  if asset_names.has_all_soft(found) then
    files["docs/calibration.md"] = calibration_page(asset_names.soft, found, o)
  end
  if #problems > 0 then
    table.insert(
      unusable,
      1,
      ("calibrate: %s\nThe files are written, without windows of these assets for experts."):format(
        table.concat(problems, "\n")
      )
    )
  end
  local problem = #unusable > 0 and table.concat(unusable, "\n") or nil
  return { text = table.concat(text, "\n"), files = files, problem = problem }
end

return softvt.experiment {
  name = "calibrate",
  options = opt,
  points = points,
  run = run,
  finish = finish,
  columns = {
    "asset",
    "kind",
    "width_mm",
    "closure",
    "held",
    "trials",
    "d_peak_pct",
    "stable",
    "d_pct",
    "d_v1_pct",
    "force_n",
    "strain_p95",
    "min_det_f",
    "node_speed_m_s",
    "both_pads",
    "slip_mm",
    "scale",
    "youngs_factor",
    "ended",
  },
}
