-- Materials of a mesh file, which an asset without visuals has.
softvt.fingerprint(softvt.asset { name = 'c', shape = softvt.mesh { file = 'c.obj', scale = 0.05 }:grounded(), body = softvt.static {}, ... }) error('fine', 0)
-- file: c.obj
mtllib c.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
usemtl a
f 1/1 3/1 2/1
f 1/1 2/1 4/1
f 1/1 4/1 3/1
f 2/1 3/1 4/1
---
visuals = nil

visuals = { { albedo = { 1, 0, 0 } } }

visuals = nil
-- file: c.mtl
newmtl a
map_Kd wood.png

visuals = nil
-- file: c.mtl
newmtl a
map_Kd wood.png
-- file: wood.png
not a picture

visuals = nil
-- file: c.mtl
newmtl a
map_Kd /home/me/wood.png

visuals = nil
-- file: c.mtl
newmtl a
map_Kd C:\me\wood.png

visuals = nil
-- file: c.mtl
newmtl a
map_Kd https://example.org/wood.png

visuals = nil
-- file: c.mtl
newmtl a
map_Kd ../../wood.png

visuals = nil
-- file: c.mtl
newmtl a
map_Kd x//..\./none.png

visuals = nil
-- file: c.mtl
newmtl a
map_Kd xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx.png

visuals = nil
-- file: c.mtl
newmtl b
