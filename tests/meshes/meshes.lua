-- Volume and bounds of mesh files, or why they are refused.
local files = require "files"

return softvt.experiment {
  name = "meshes",
  grid = { file = files },
  run = function(point)
    local ok, shape = pcall(softvt.mesh, { file = point.file })
    if not ok then return { refused = tostring(shape) } end
    local low, high = shape:bounds()
    return { volume = shape:volume(), low = low, high = high }
  end,
}
