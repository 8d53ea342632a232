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

softvt.soft { density = 200, youngs_pa = 1e4, poisson = 0.3, loss_factor = -0.1 }

softvt.soft { density = 200, youngs_pa = 1e4, poisson = 0.3, loss_factor = 2 }

softvt.soft { density = 200, youngs_pa = 1e4, poisson = 0.5 }

softvt.asset { name = 'a', shape = ball, body = softvt.static {}, friction = { static_mu = 0.1 } }

assert(math.abs(softvt.shape.box { size = { 0.1, 0.04, 0.03 } }:volume() - 1.2e-4) < 1e-15)
assert(math.abs(softvt.shape.sphere { radius = 0.03 }:grounded():volume() - 4 / 3 * math.pi * 0.03 ^ 3) < 1e-12)
error('volumes of closed forms', 0)

-- A reference is made once for an object, and for other materials than those of its text alone.
local sphere, text = require 'assets.sphere', softvt.calibration('sphere').json
local function ball(youngs, resolution)
  return softvt.asset { name = 'sphere', shape = sphere.shape, body = softvt.soft {
    youngs_pa = youngs, poisson = 0.3, density = 300, resolution = resolution } }
end
local soft, fine = softvt.draw_reference(ball(5e3, 6), text), softvt.draw_reference(ball(5e3, 7), text)
assert(not softvt.draw_reference(sphere, text) and soft and soft == fine)
error('made once', 0)
