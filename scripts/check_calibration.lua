-- Checks calibrations: how D_ref and τ depend on the step, the meshes and the size, and whether the ends of the windows
-- act.
--
--   softvt scripts/check_calibration.lua                                  all standard soft assets
--   softvt scripts/check_calibration.lua --asset cube --part ends --trials 20 --out checked
--
-- --part numerics repeats the sweep of the press with half of the step, with strains on a mesh 4/3 as fine, with
-- widths, forces and D on the mesh of the strains, and with the object at 0.9 and 1.1 of its size. --part ends runs
-- trials with the robot's hand and the expert's lift, 5 % of the window inside and outside of each end, displaced as in
-- the calibration and as the expert displaces its grasps. If all standard assets are checked in both parts, it writes
-- docs/calibration_checks.md.
local asset_names = require "asset_names"
local grasp = require "experts.grasp"
local hand = require "calibration.hand"
local press = require "calibration.press"
local trial = require "calibration.trial"
local soft_asset = require "calibration.soft_asset"

local opt = softvt.options {
  asset = { default = asset_names.soft, help = "assets to check" },
  part = { default = { "numerics", "ends" }, choices = { "numerics", "ends" }, help = "checks" },
  step_mm = {
    default = 0.5,
    unit = "mm",
    min = 0.04,
    max = 5,
    only_with = { part = "numerics" },
    needs_out = true,
    help = "step of the width, which is halved",
  },
  trials = {
    default = 100,
    integer = true,
    min = 1,
    max = 1000,
    only_with = { part = "ends" },
    needs_out = true,
    help = "hold trials at each side of each end, displaced as in the calibration",
  },
  expert_trials = {
    default = 20,
    integer = true,
    min = 1,
    max = 1000,
    only_with = { part = "ends" },
    needs_out = true,
    help = "hold trials at each side of each end, displaced as the expert displaces its grasps",
  },
}
local parts = {}
for _, part in ipairs(opt.part) do
  parts[part] = true
end

local assets, calibrations = {}, {}
for _, name in ipairs(opt.asset) do
  assets[name], calibrations[name] = soft_asset("check_calibration", name, assets), softvt.calibration(name)
  if parts.ends then
    local found = calibrations[name]
    local is_present = found
      and found.table.fingerprints
      and found.table.fingerprints[name] == softvt.fingerprint(assets[name])
    if not (is_present and softvt.grip_window { asset = name }) then
      error(
        ("check_calibration: %s has no calibrated window, or one of another shape, material, friction or version; run softvt scripts/calibrate.lua --asset %s first"):format(
          name,
          name
        ),
        0
      )
    end
  end
end

local END_SHARE = 0.05 -- distance from an end of the window, as a share of the window
local BATCH = 10 -- trials of a point
local HOLD_S = 1 -- hold after the lift, s
-- Largest displacements of the grasps, m: that of the calibration and that of the expert; and the options with their
-- trials.
local SPREADS = { trial.DISPLACEMENT, grasp.SPREAD }
local TRIALS = { "trials", "expert_trials" }

-- Changes of the sweep by name, in the order of the page: factors on its step and the size of the object, and on the
-- resolution of the mesh of the strains, for that mesh (`fine`) or for the mesh of widths, forces and D (`resolution`).
local CHANGES = {
  { name = "nominal" },
  { name = "half_step", step = 0.5 },
  { name = "finer", fine = 4 / 3 },
  { name = "converged", resolution = 1 },
  { name = "scale_0.9", scale = 0.9 },
  { name = "scale_1.1", scale = 1.1 },
}

-- D (%) and force (N) of the rows of a sweep at a width, mm; nil beyond them or without a width.
local function at_width(rows, width)
  if not width then return nil end
  for k = 2, #rows do
    local wide, narrow = rows[k - 1], rows[k]
    if wide.width_mm >= width and narrow.width_mm <= width then
      local share = (wide.width_mm - width) / (wide.width_mm - narrow.width_mm)
      return wide.d_pct + share * (narrow.d_pct - wide.d_pct), wide.force_n + share * (narrow.force_n - wide.force_n)
    end
  end
end

-- D_ref of the sweep with one change, and D and force at the tight end of the window and at D_ref.
local function numerics(point, o)
  local asset, known, change = assets[point.asset], calibrations[point.asset], point.change
  local fine = press.fine_resolution(asset, change)
  local function finer(factor) return factor and math.ceil(factor * fine) end
  local found, sweep = press.envelope(asset, 1e-3 * o.step_mm * (change.step or 1), {
    scale = change.scale,
    fine = finer(change.fine),
    resolution = finer(change.resolution),
  })
  local d_tight_pct, force_tight_n = at_width(sweep.rows, known and known.window.tight.width_mm)
  local d_end_pct, force_end_n = at_width(sweep.rows, known and known.width_at_d_ref_mm)
  return {
    asset = point.asset,
    check = change.name,
    d_ref_pct = found.d_ref,
    censored = found.censored,
    d_tight_pct = d_tight_pct,
    force_tight_n = force_tight_n,
    d_end_pct = d_end_pct,
    force_end_n = force_end_n,
  }
end

-- A batch of trials at an end of the window: a share of the window inside of it, or outside.
local function ends(point)
  local name, window = point.asset, calibrations[point.asset].window
  local inward = (point.at == "loose" and 1 or -1) * (point.side == "inside" and END_SHARE or -END_SHARE)
  local along = (point.at == "loose" and 0 or 1) + inward
  local width = 1e-3 * (window.loose.width_mm + along * (window.tight.width_mm - window.loose.width_mm))
  -- Before contact there is no force.
  local grip =
    { width = width, force = softvt.force_at(calibrations[name].table.envelopes[name].sweep, 1e3 * width) or 0 }
  local held, d_peak_pct, width_mm = hand.trials(assets[name], grip, point.first, point.last, point.spread, HOLD_S)
  return {
    asset = name,
    check = point.at .. "_" .. point.side,
    spread_mm = 1e3 * point.spread,
    width_mm = width_mm,
    trials = point.last - point.first + 1,
    held = held,
    d_peak_pct = d_peak_pct,
  }
end

local function points(o)
  local list = {}
  for _, name in ipairs(o.asset) do
    for _, change in ipairs(parts.numerics and CHANGES or {}) do
      list[#list + 1] = { asset = name, change = change }
    end
    for _, at in ipairs(parts.ends and { "loose", "tight" } or {}) do
      for _, side in ipairs { "inside", "outside" } do
        for index, spread in ipairs(SPREADS) do
          local trials = o[TRIALS[index]]
          for first = 1, trials, BATCH do
            list[#list + 1] = {
              asset = name,
              at = at,
              side = side,
              spread = spread,
              first = first,
              last = math.min(trials, first + BATCH - 1),
            }
          end
        end
      end
    end
  end
  return list
end

-- The key of a check; those of the ends are made with grasps displaced by up to `spread_mm`.
local function key(check, spread_mm) return spread_mm and ("%s %g"):format(check, spread_mm) or check end

-- The rows of each asset and check; batches of trials are added up.
local function by_asset(rows)
  local found = {}
  for _, row in ipairs(rows) do
    local of_asset = found[row.asset] or {}
    found[row.asset] = of_asset
    local sum = of_asset[key(row.check, row.spread_mm)]
    if sum then
      sum.held, sum.trials, sum.d_peak_pct =
        sum.held + row.held, sum.trials + row.trials, math.max(sum.d_peak_pct, row.d_peak_pct)
    else
      of_asset[key(row.check, row.spread_mm)] = row
    end
  end
  return found
end

local function table_of(header, names, cells)
  local lines = { "| " .. table.concat(header, " | ") .. " |", "|" .. ("---|"):rep(#header) }
  for _, name in ipairs(names) do
    lines[#lines + 1] = "| " .. table.concat(cells(name), " | ") .. " |"
  end
  return table.concat(lines, "\n") .. "\n"
end

-- Change of D_ref from one row to another, %.
local function change_of(from, to)
  if not (from.d_ref_pct and to.d_ref_pct) then return "no D_ref: " .. (from.censored or to.censored or "") end
  local text = ("%+.1f"):format(100 * (to.d_ref_pct / from.d_ref_pct - 1)):gsub("^[+-]0%.0$", "0.0")
  return text .. ((from.censored or to.censored) and " (censored)" or "")
end

-- Errors of D or of the force on the mesh of episodes at both widths, %.
local function errors(own, converged, of)
  local unit, shown = of == "d" and "pct" or "n", {}
  for _, at in ipairs { "tight", "end" } do
    local key = ("%s_%s_%s"):format(of, at, unit)
    local is_known = own[key] and converged[key]
    shown[#shown + 1] = is_known and ("%+.1f"):format(100 * (own[key] / converged[key] - 1)) or "–"
  end
  return table.concat(shown, ", ")
end

local function numerics_table(found, names)
  return table_of(
    {
      "asset",
      "resolution",
      "D_ref %",
      "half step, %",
      "strains on a mesh 4/3 as fine, %",
      "D at the tight end, at D_ref, %",
      "force there, %",
      "size 0.9, %",
      "size 1.1, %",
    },
    names,
    function(name)
      local rows = found[name]
      local nominal = rows.nominal
      return {
        name,
        ("%d"):format(assets[name].body.resolution),
        nominal.d_ref_pct and ("%.3f"):format(nominal.d_ref_pct) or "–",
        change_of(nominal, rows.half_step),
        change_of(nominal, rows.finer),
        errors(nominal, rows.converged, "d"),
        errors(nominal, rows.converged, "force"),
        change_of(nominal, rows["scale_0.9"]),
        change_of(nominal, rows["scale_1.1"]),
      }
    end
  )
end

local function ends_table(found, names)
  local function held(row) return ("%d of %d"):format(row.held, row.trials) end
  local function largest(row) return ("%.3f"):format(row.d_peak_pct) end
  -- `show` of one side of an end, for each displacement.
  local function of_end(show, rows, at, side)
    local shown = {}
    for _, spread in ipairs(SPREADS) do
      shown[#shown + 1] = show(rows[key(at .. "_" .. side, 1e3 * spread)])
    end
    return table.concat(shown, ", ")
  end
  return table_of(
    {
      "asset",
      "held, loose inside",
      "held, loose outside",
      "τ %",
      "largest D %, tight inside",
      "largest D %, tight outside",
    },
    names,
    function(name)
      local rows = found[name]
      return {
        name,
        of_end(held, rows, "loose", "inside"),
        of_end(held, rows, "loose", "outside"),
        ("%.3f"):format(calibrations[name].tau),
        of_end(largest, rows, "tight", "inside"),
        of_end(largest, rows, "tight", "outside"),
      }
    end
  )
end

local HEAD = [[
# Checks of the calibration

Generated by `softvt scripts/check_calibration.lua`.

## Numerical parameters

Change of D_ref, and so of τ, with half of the step of the width of %g mm, with strains on a mesh 4/3 as fine as that of the calibration, and
with the object at 0.9 and 1.1 of its size. The pads keep their size, so that they cover more of a smaller object. Between them the errors of
D and force on the mesh of episodes: at the widths of the tight end of the window and of D_ref, against the mesh on which strains are found. The
resolution of episodes is the number of voxels along the longest edge.

]]
local ENDS = [[

## Ends of the window

Trials with the robot's hand and the expert's lift, 5 %% of the window inside and outside of each end. The hand is commanded to the width
and force of the press there. Trials differ in the place of the grasp alone: it is displaced in each horizontal direction by up to
%g mm, as in the press that found the window (before the comma), and by up to %g mm, as the expert displaces its own grasps (after
the comma). The hand is not turned.

]]

return softvt.experiment {
  name = "check_calibration",
  options = opt,
  points = points,
  run = function(point, o) return point.change and numerics(point, o) or ends(point) end,
  finish = function(rows, o)
    local found, text = by_asset(rows), {}
    if parts.numerics then text[#text + 1] = numerics_table(found, o.asset) end
    if parts.ends then text[#text + 1] = ends_table(found, o.asset) end
    local is_page = parts.numerics and parts.ends and asset_names.has_all_soft(found)
    return {
      text = table.concat(text, "\n"),
      files = is_page and {
        ["docs/calibration_checks.md"] = HEAD:format(o.step_mm) .. text[1] .. ENDS:format(
          1e3 * SPREADS[1],
          1e3 * SPREADS[2]
        ) .. text[2],
      } or {},
    }
  end,
  columns = {
    "asset",
    "check",
    "d_ref_pct",
    "censored",
    "d_tight_pct",
    "force_tight_n",
    "d_end_pct",
    "force_end_n",
    "spread_mm",
    "width_mm",
    "trials",
    "held",
    "d_peak_pct",
  },
}
