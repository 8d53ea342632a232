-- Loads the soft asset `name` for the script `script`; `loaded` are those loaded before.
return function(script, name, loaded)
  if loaded[name] then error(("%s: --asset names %s twice"):format(script, name), 0) end
  local found, asset = pcall(require, "assets." .. name)
  if not found then
    -- The name is from the command line: a line of this file would say nothing.
    local request = ("require %q: "):format("assets." .. name)
    local _, last = tostring(asset):find(request, 1, true)
    if last then error(("%s: --asset %s: %s"):format(script, name, tostring(asset):sub(last + 1)), 0) end
    error(asset, 0)
  end
  if tostring(asset.body) ~= "softvt.soft" then
    error(("%s: %s is not soft: only a body of softvt.soft deforms"):format(script, name), 0)
  end
  -- Limits are found by the name of the asset, and scripts name its file.
  if asset.name ~= name then
    local message = "%s: assets/%s.lua has the name %q; name it %q, or the file %s.lua"
    error(message:format(script, name, asset.name, name, asset.name), 0)
  end
  return asset
end
