-- Text of docs/calibration.md: the safe envelope of each soft asset.

local HEAD = [[
# Safe envelopes of the soft assets

Generated together with `assets/calibration/` by `softvt scripts/calibrate.lua`, which documents the method. Each plot shows peak D
(% of the bounding-box diagonal) over the closure of the gripper: `●` a stable squeeze, `○` an unstable one, `╌` τ. The rows below
show the results of five grasp–lift–hold trials (`+` all held, `~` some, `-` none) and the zones: `░` too loose, `█` safe window,
`▓` too tight. The expert closes to the middle of the safe window.

| asset | D_ref % | τ % | holds from | τ at |
|---|---|---|---|---|
]]

-- Returns the page for `names`; `found` maps each name to a result of softvt.envelope or softvt.calibration.
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
