-- Returns the suites of the files of suites/ with these names, without .lua, as one list. A file may return several, as
-- suites/all.lua does.
return function(names)
  local suites = {}
  for _, name in ipairs(names) do
    local found = require("suites." .. name)
    for _, suite in ipairs(#found > 0 and found or { found }) do
      table.insert(suites, suite)
    end
  end
  return suites
end
