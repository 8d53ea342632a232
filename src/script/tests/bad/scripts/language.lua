-- Errors of the language, of functions that the sandbox lacks, and of error objects.
---
local a = 1
local b = = 2

local t = nil
print(t.x)

error('oh', 0)

error { code = 3, what = 'jam' }

error(nil)

error(function() end)

error(softvt.pose { position = { 0, 0, 0 } })

error(setmetatable({}, { __tostring = function() error('again') end }))

error(setmetatable({}, { __tostring = function() while true do end end }))

softvt.suit {}

local f, message = load('\27Lua')
error(message, 0)

os.exit(0)

for _, name in ipairs { "io", "os", "debug", "package", "dofile", "loadfile", "collectgarbage", "warn" } do
  assert(rawget(_G, name) == nil, name)
end
assert(string.dump == nil)
error("none of them", 0)

setmetatable({}, { __gc = function() end })

string.format('%99999d', 1)

string.format('%d', 'x')

string.format('%p', {})

coroutine.yield(1)

local f
f = function() return pcall(f) end
local ok, m = f()
error(tostring(ok), 0)

local function w(n) return coroutine.wrap(function() return w(n + 1) end)() end
return w(0)

local f
f = function(s) return s:gsub('.', f) end
f('x')

local _, m = load(('('):rep(1e5))
error('<' .. m .. '>')

local t = setmetatable({}, {})
getmetatable(t).__index = t
return { a = t.x }

local _, m = pcall(softvt.pose, 3)
error(m, 0)

local _, m = pcall(softvt.pose, 3)
error('so: ' .. m)

setmetatable(softvt, {})

getmetatable('').__index = nil
return ('x'):rep(3)

tostring = nil
print(1)
string.format, table.unpack, pcall, error, setmetatable, pairs = nil
for _ in ipairs {} do
end
return {}

local shifts = require 'shifts'
return shifts.sofd

local grasp = require 'experts.grasp'
grasp.own = 1
for key in pairs(grasp) do
  if key == 'own' then error('added ' .. grasp.own) end
end

math.randomseed(1)

math.random(2, 1)

error(math.random() .. ' ' .. math.random(10) .. ' ' .. math.random(-3, 3), 0)

local t = { 1, 1, [true] = 1 }
for _, key in ipairs { 'z', 'b', 'q', 'a' } do t[key] = 1 end
local keys = {}
for key in pairs(t) do keys[#keys + 1] = tostring(key) end
error(table.concat(keys, ' '), 0)

local values = { {}, print, softvt.pose { position = { 0, 0, 0 } }, softvt.on { object = 'a', target = 'b' } }
for i, value in ipairs(values) do values[i] = tostring(value) .. ('%s'):format(value) end
error(table.concat(values, ' '), 0)

local t = {}
for i = 40, 1, -1 do t['k' .. i] = i end
t[3] = 1 t[true] = 1
local first, second = {}, {}
for k, v in pairs(t) do first[#first + 1] = tostring(k) .. v end
for k, v in next, t do second[#second + 1] = tostring(k) .. v if v == 7 then t[k] = nil end end
assert(#first == 42 and table.concat(first, ' ') == table.concat(second, ' '))
assert(next(t, 'k6') == 'k8' and next(t, 3) == 'k1' and next(t, true) == nil and next {} == nil)
local n = 0
for _, v in pairs { [{}] = 1, a = 2 } do n = 10 * n + v end
error(n, 0)

pairs { [{}] = 1, [print] = 2 }

next { [{}] = 1, [print] = 2 }

local t = { a = 1 }
next(t, 'b')

-- main: a/long/path/of/folders/that/lua/shortens/in/all/of/its/messages/x.lua
error 'oh'

coroutine.wrap(function()
  coroutine.wrap(function() error 'oh' end)() end)()
