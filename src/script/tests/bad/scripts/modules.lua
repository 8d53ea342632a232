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
