-- Tables with other keys or values than declared.
---
softvt.on {
  object = 'a',
  target = 'b',
  hold_s = '0.4'
}

softvt.on {
  object = 'a',
  target = 'b',
  hold_s = 0 / 0
}

softvt.on {
  object = 'a',
  target = 'b',
  hold = 1
}

softvt.on {
  object = 'a',
  target = 'b',
  [1] = 2
}

softvt.on { object = 'a' }

softvt.on 'a'

softvt.shape.box {
  size = { 1, 0 / 0, 1 }
}

softvt.shape.box { size = { 1, 1, 1 / 0 } }

softvt.shape.box { size = { 'a', 1, 1 } }

softvt.shape.box { size = { 1, 1 } }

softvt.shape.box { size = { 1, 1, 1, 1 } }

softvt.shape.box { size = { 1, 1, x = 1 } }

softvt.shape.box { size = 0 / 0 }

softvt.shift { name = 's', default = 1, min = 2, apply = function() end }

softvt.shift { name = 's', default = 1, min = 3, max = 0.1, apply = function() end }

softvt.calibration '../x'

softvt.calibration 'odd'
-- file: assets/calibration/odd.json
{}

softvt.plot { title = 'a', x = { label = 'x' }, y = { label = 'y', log = true }, series = { { points = { { 0, 0 } } } } }

softvt.plot { title = 'a', x = { label = 'x' }, y = { label = 'y' }, series = {} }

local none = { points = {} }
softvt.plot { title = 'a', x = { label = 'x' }, y = { label = 'y' }, series = { none, none, none, none, none, none, none } }

softvt.plot { title = 'a', x = { label = 'x' }, y = { label = 'y' }, series = { { points = { { 0 / 0, 1 } } } } }

softvt.plot { title = 'a', x = { label = 'x' }, y = { label = 'y' }, series = { { points = { { 1 } } } } }

local s = softvt.plot { title = 'a', x = { label = 'x' }, y = { label = 'y', log = true },
  series = { { label = 'one', points = { { 0, 1 }, { 1, 10 } } } }, levels = { { y = 5, label = 'limit' } } }
error(s:sub(1, 4) .. tostring(s:find('limit', 1, true) ~= nil), 0)

local calibration = softvt.calibration 'sphere'
assert(calibration.window.extent_mm > 1 and calibration.tau > 0 and softvt.calibration 'nothing_like_it' == nil)
error('read', 0)
