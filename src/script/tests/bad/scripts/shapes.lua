-- Shapes and materials that cannot be meant.
local ball = softvt.shape.sphere { radius = 0.005 } local box = softvt.shape.box { size = { 0.1, 0.04, 0.04 } } local cube = softvt.shape.box { size = { 0.04, 0.04, 0.04 } }
---
box:rotate { axis = 'z', angle = 90 }

box:shell(2)

box:bend { along = 'x', towards = 'z', curvature = -60 }

box:bend { along = 'x', towards = 'y', curvature = 40 }

box:shell(0.01)

softvt.shape.sphere { radius = 0.03 }:ridges { pitch = 1e-3, height = -0.0015 }

softvt.shape.sphere { radius = -1 }

softvt.shape.box { size = { 1, 0, 1 } }

cube:subtract(ball:translate(0, 0, 17))

cube:ridges { height = 0.003 }

cube:paint { material = 1, region = ball:translate(0.2, 0, 0) }

softvt.soft { density = 200, youngs_pa = -1, poisson = 0.3 }

softvt.soft { density = 200, youngs_pa = 1e4, poisson = 0.5 }

softvt.asset { name = 'a', shape = ball, body = softvt.static {}, friction = { static_mu = 0.1 } }
