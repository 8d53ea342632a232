-- Text of docs/calibration.md: the safe envelope of each soft asset.
local HEAD = [[
# Safe envelopes of the soft assets

Generated together with `assets/calibration/` by `softvt scripts/calibrate.lua`, which documents the method: a press test of the object
alone, between two gel pads of the robot at a prescribed width. D_ref is D at the width at which 5 % of the volume is beyond the *stable
strain* of the material, averaged over 4 mm and on a mesh with voxels of at most 4 mm, and τ = κ D_ref. Each object is safe at widths between the *loose* end, up to which friction carries it,
and the *tight* end, at which D reaches τ, pressed on the table or carried. Forces are those per pad at rest. *Carried D* is the smallest
peak of D while the object was lifted and held; an object with a carried D above τ cannot be carried safely, whatever the grip.
A press that ended before the stable strain gives a lower bound of D_ref (≥).
[assets.md](assets.md) gives the strains with their sources, [calibration_checks.md](calibration_checks.md) how the results depend on step,
resolution and size, and trials at the ends of the windows.
]]

local SHEET = [[
![D over its limit, over the closing of the pads from first contact, of every asset on the same axes](images/calibration.svg)

D over τ against the closing of the pads from first contact, of all assets on the same axes, those first that bear the least closing. The
dashed line is the limit; the band is the safe window, hatched if it holds for presses only.

]]

local TABLE = [[
| asset | stable strain | D_ref % | τ % | κ 0.3 | κ 0.7 | loose mm | tight mm | window mm | force N | carried D % |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
]]

local MIDDLE = [[

Each plot shows D (% of the bounding-box diagonal) over the width. Dots are stable squeezes, rings unstable ones; diamonds are peaks of D
in hold trials, filled if all trials held; dashed lines are τ and D_ref, and the band is the safe window. A hatched band holds for presses
only: the carried object was above τ at every width, which "pressed only" says in the table.
]]

local PROTOCOLS = { press = "Sweep: press test", hand = "Sweep: the robot's hand, where D_ref is the largest stable D" }

-- Returns the page for `names`; `found` maps each name to a result of softvt.envelope. `o` has the fields
-- sweep_protocol and kappa.
return function(names, found, o)
  local function number(format, value) return value and format:format(value) or "–" end
  local rows, plots = {}, {}
  for _, name in ipairs(names) do
    local known = found[name]
    local window, d_ref = known.window, known.d_ref
    local force = number("%.2f", window.loose.force_n) .. "–" .. number("%.2f", window.tight.force_n)
    local is_pressed_only = known.carried_d and known.tau and known.carried_d > known.tau
    local cells = {
      ("[%s](#%s)"):format(name, name),
      number("%.2f", known.stable_strain),
      number(known.censored and "≥ %.3f" or "%.3f", d_ref),
      number("%.3f", known.tau),
      number("%.3f", d_ref and 0.3 * d_ref),
      number("%.3f", d_ref and 0.7 * d_ref),
      number("%.2f", window.loose.width_mm),
      number("%.2f", window.tight.width_mm),
      number("%.2f", window.extent_mm) .. (is_pressed_only and " (pressed only)" or ""),
      force,
      number("%.3f", known.carried_d),
    }
    rows[#rows + 1] = "| " .. table.concat(cells, " | ") .. " |\n"
    plots[#plots + 1] = ("\n## %s\n\n![D of %s over the width between the gels](../assets/calibration/%s.svg)\n\n```text\n%s```\n"):format(
      name,
      name,
      name,
      known.text
    )
  end
  return HEAD
    .. ("\n%s; κ = %g.\n\n"):format(PROTOCOLS[o.sweep_protocol], o.kappa)
    .. SHEET
    .. TABLE
    .. table.concat(rows)
    .. MIDDLE
    .. table.concat(plots)
end
