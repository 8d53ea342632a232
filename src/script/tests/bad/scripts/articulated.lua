-- Joints and parts of articulated objects.
local box = softvt.shape.box { size = { 0.1, 0.1, 0.03 } } local slider = softvt.slider { axis = { 0, -2, 0 }, lower = 0, upper = 0.1, friction = 1 }
local function part(name, parent, joint) return { name = name, parent = parent, shape = box, density = 500, joint = joint or slider } end
---
softvt.slider { axis = { 0, -1, 0 } }

softvt.hinge { axis = { 0, 0, 1 }, origin = { 0, 0, 0 },
  lower = -1 }

softvt.slider { axis = { 0, -1, 0 }, lower = 0,
  upper = -0.1 }

softvt.slider { lower = 0, upper = 1,
  axis = { 0, 0, 0 } }

softvt.slider { axis = { 0, 1, 0 }, lower = 0, upper = math.huge }

softvt.slider { axis = { 0, 1, 0 }, lower = 0, upper = 1, damping = -1 }

softvt.articulated { parts = { { name = 'a', shape = box, density = 500,
  joint = { axis = { 0, 1, 0 } } } } }

softvt.articulated { parts = {} }

softvt.articulated { parts = { part 'drawer', part 'drawer' } }

softvt.articulated { parts = { part 'flp', part('lid', 'flap') } }

softvt.articulated { parts = { part('flap', 'lid'), part('lid', 'flap') } }
