-- Modules that cannot be required.
---
require [[../secret]]

require [[..secret]]

require [[/etc/passwd]]

require [[a..b]]

require [[a/../../b]]

require [[C:\x]]

require [[]]

local a = require 'lib.a'
assert(a.n == 1 and require 'lib.a' == a)
require 'b'
-- file: scripts/lib/a.lua
return { n = 1 }
-- file: b.lua
return require 'c'
-- file: c.lua
return require 'b'

-- Messages of modules name them.
require 'late'
-- file: late.lua
local x
return x.y

-- main: suites/shifts.lua
local shifts = require 'shifts'
error(shifts.soft[1].name, 0)

-- main: suites/x.lua
error(require 'shifts', 0)
-- file: suites/shifts.lua
return 'the suite'
-- file: scripts/shifts.lua
return 'the module'

-- Points may read files, which later machines then hold.
return softvt.experiment { name = 'e',
  points = function() return { { a = require('lib').value } } end,
  run = function(point) return { a = point.a, again = require('lib').value } end }
-- file: lib.lua
return { value = 7 }
