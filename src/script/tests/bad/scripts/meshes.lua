-- Mesh files that cannot be read, and their materials.
error(tostring(softvt.mesh { file = ... }), 0)
-- file: open.obj
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
---
'open.obj'

'empty.obj'
-- file: empty.obj
v 0 0 0

'good.obj'
-- file: good.obj
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4

'mesh.doc'
-- file: mesh.doc

'../a.obj'

'none.obj'
