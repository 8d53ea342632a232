-- Goals that no state can meet, and similar ones that a state can.
local small = require 'small' local shape = softvt.shape.box { size = { 0.1, 0.1, 0.01 } }:grounded()
local drawer = { name = 'drawer', shape = shape:translate(0, 0, 0.05), density = 500, joint = softvt.slider { axis = { 0, 1, 0 }, lower = 0, upper = 0.1 } }
local chest = softvt.asset { name = 'chest', shape = shape, body = softvt.articulated { parts = { drawer } } }
local function add(scene) scene:add { name = 'chest', asset = chest, at = { 1, 0 } } for i, name in ipairs { 'a', 'b', 'c' } do scene:add { name = name, asset = small.ball, at = { 2, 0.2 * i } } end end
local all, any, none, sequence = softvt.all, softvt.any, softvt.none, softvt.sequence
local function opened(share) return softvt.opened { joint = 'chest.drawer', share = share } end
local function closed(share) return softvt.closed { joint = 'chest.drawer', share = share } end
local function turned(range) return softvt.turned { joint = 'chest.drawer', range = range } end
local function on(object, target) return softvt.on { object = object, target = target } end
local function near(object, target, distance, hold_s) return softvt.near { object = object, target = target, distance = distance, hold_s = hold_s } end
local function beside(side, object, target) return softvt.beside { side = side, object = object, target = target, hold_s = 0 } end
local function upright(angle) return softvt.upright { object = 'a', angle = angle } end
local suite = small.suite { goal = ..., build = add } suite.tasks[1].object = 'a' return suite
---
all { on('a', 'b'), none { on('a', 'b') } }

all { on('a', 'b'), on('b', 'c'), on('c', 'a') }

all { opened(0.7), closed(0.1) }

all { beside('left_of', 'a', 'b'), beside('behind', 'a', 'b') }

all { opened(0.7), any { closed(0.1), none { opened(0.7) } } }

sequence { all { opened(0.7), closed(0.1) }, on('a', 'b') }

none { none { opened(0.7) }, opened(0.7) }

all { near('a', 'b', 0.05), none { near('a', 'b', 0.15) } }

-- The robot does not touch the object of a placement: the reverse one does not follow.
all { near('a', 'b', 0.05), none { near('b', 'a', 0.15) } }

all { near('a', 'b', 0.05), none { near('a', 'b', 0.15, 2) } }

all { near('a', 'b', 0.15), none { near('a', 'b', 0.05) } }

all { near('a', 'b', 0.05), none { near('a', 'c', 0.15) } }

all { beside('left_of', 'a', 'b'), beside('right_of', 'b', 'a') }

all { beside('left_of', 'a', 'b'), beside('left_of', 'b', 'a') }

all { near('b', 'a', 0.04), beside('behind', 'a', 'b') }

all { upright(0.1), none { upright(0.2) } }

all { opened(0.7), none { opened(0.5) } }

all { opened(0.9), turned { 0, 0.02 } }

-- 0.3 × 0.1 is rounded.
all { opened(0.3), turned { 0, 0.03 } }

any { opened(0.9), turned { 0, 0.02 } }

all { on('a', 'b'), on('b', 'c'), on('a', 'c') }

all { opened(0.5), closed(0.5) }

any { opened(0.7), closed(0.1) }

all { opened(0.7), any { closed(0.1), on('a', 'b') } }

sequence { opened(0.7), closed(0.1) }

sequence { on('a', 'b'), on('b', 'a') }

all { on('a', 'b'), none { all { on('a', 'b'), opened(0.7) } } }

none { opened(0.7), closed(0.1) }

all { closed(0.1), none { sequence { opened(0.7), closed(0.1) } } }
