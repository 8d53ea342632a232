-- Lists of objects are live, and quaternions and directions may have any length.
local small = require 'small'
return small.suite { build = function(scene, rng) ... end }
---
scene.base[1] = 0.25 assert(scene.base[1] == 0.25)

local b = scene.base b[1] = 0.5 scene.base = b assert(scene.base[1] == 0.5)

local q = scene.start_q for i = 1, #q do q[i] = q[i] + 0.5 end
scene.start_q = q assert(#q == 7 and scene.start_q[7] == q[7])

scene.light.colour[2] = 0.5 assert(scene.light.colour[2] == 0.5)

local n = 0 for i, x in ipairs(scene.gravity) do n = n + i * x end assert(n == 3 * -9.81)

local n = 0 for i, x in pairs(scene.gravity) do n = n + i * x end assert(n == 3 * -9.81)

local n = 0 for i, x in softvt.sorted(scene.gravity) do n = n + i * x end assert(n == 3 * -9.81)

scene.gravity = { 0, 0, -1 } local x, y, z, more = table.unpack(scene.gravity) assert(z == -1 and more == nil)

scene.gravity = { 1, 2, 3 } assert(table.concat(scene.gravity, ' ') == '1.0 2.0 3.0' and scene.gravity[4] == nil)

assert(tostring(scene.gravity) == '{0, 0, -9.81}' and ('%s'):format(scene.gravity) == '{0, 0, -9.81}')

scene.workspace_min = scene.base assert(scene.workspace_min[1] == scene.base[1])

assert(softvt.pose { position = scene.base }.x == scene.base[1] and rng:choice(scene.base))

assert(#scene.objects == 0 and #rng:shuffle(scene.objects) == 0)

local c = scene:camera 'wrist' c.quaternion = { 1e200, 0, 0, 1e200 } assert(math.abs(c.quaternion[1] - 0.5 ^ 0.5) < 1e-12)

assert(math.abs(softvt.pose { position = { 0, 0, 0 }, quaternion = { 0, 1e308, -1e308, 0 } }.quaternion[2]) > 0.7)

local l = scene.light l.direction = { 1e308, 1e308, 0 } assert(math.abs(l.direction[1] - 0.5 ^ 0.5) < 1e-12)

local l = scene.light l.direction = { 0, 3, 4 } assert(l.direction[2] == 3)

assert(not pcall(error)) -- An assertion that fails is seen.
assert(scene.gravity[3] == 0, 'gravity')
