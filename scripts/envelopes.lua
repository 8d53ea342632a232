-- The calibration page: how far each soft asset may be squeezed, with the plot of its envelope.

local HEAD = [[
# How far each soft asset may be squeezed

Written, with `assets/calibration/`, by `softvt scripts/calibrate.lua`; the method is told there. Each plot shows peak D (% of the
bounding box's diagonal) over the closure of the gripper: `●` a stable squeeze, `○` one that is not, `╌` τ. Under it, how
often five grasp–lift–hold trials held (`+` all, `~` some, `-` none), and the zones: `░` too loose, `█` safe window, `▓` too tight.
The expert closes to the middle of the window.

| asset | D_ref % | τ % | holds from | τ at |
|---|---|---|---|---|
]]

-- The page of `names`; `found` has what softvt.envelope or softvt.calibration gave for each.
return function(names, found)
  local function number(format, value) return value and format:format(value) or "–" end
  local rows, plots = {}, {}
  for _, name in ipairs(names) do
    local known = found[name]
    rows[#rows + 1] = ("| [%s](#%s) | %s | %s | %s | %s |\n"):format(
      name, name, number("%.3f", known.d_ref), number("%.3f", known.tau), number("%.2f", known.lower), number("%.3f", known.closure_at_tau))
    plots[#plots + 1] = ("\n## %s\n\n```text\n%s```\n"):format(name, known.text)
  end
  return HEAD .. table.concat(rows) .. table.concat(plots)
end
