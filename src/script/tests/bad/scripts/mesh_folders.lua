-- Meshes are searched next to the requesting file, and in the project.
---
local heights = {}
for _, name in ipairs { 'a', 'far.b', 'lonely.c' } do
  local _, high = require('assets.' .. name).shape:bounds() heights[#heights + 1] = high[3]
end
error(table.concat(heights, ' '), 0)
-- file: assets/a.lua
return { shape = softvt.mesh { file = 'm.obj' } }
-- file: assets/far/b.lua
return { shape = softvt.mesh { file = 'm.obj' } }
-- file: assets/lonely/c.lua
return { shape = softvt.mesh { file = 'm.obj' } }
-- file: assets/m.obj
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
-- file: assets/far/m.obj
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 2
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
-- file: m.obj
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 3
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
