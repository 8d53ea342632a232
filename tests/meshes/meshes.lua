-- Volume and bounds of mesh files, or why they are refused.
local files = require "files"
local read = {}
for _, file in ipairs(files) do
  local ok, shape = pcall(softvt.mesh, { file = file })
  read[file] = ok and { shape = shape } or { refused = tostring(shape) }
end

return softvt.experiment {
  name = "meshes",
  grid = { file = files },
  run = function(point)
    local shape = read[point.file].shape
    if not shape then return { file = point.file, refused = read[point.file].refused } end
    local low, high = shape:bounds()
    return { file = point.file, volume = shape:volume(), low = low, high = high }
  end,
}
