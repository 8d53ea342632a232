-- Scripts that would take all time or all memory.
---
local i = 0
while true do
  i = i + 1
end

while true do end

while true do pcall(function() while true do end end) end

local function f() return f() end f()

local c = coroutine.wrap(function() while true do end end) c()

local c = coroutine.wrap(function() while true do coroutine.yield() end end) while true do c() end

while true do coroutine.resume(coroutine.create(function() while true do end end)) end

while true do xpcall(function() while true do end end, function() while true do end end) end

while true do local x <close> = setmetatable({}, { __close = function() while true do end end }) end

local t = setmetatable({}, { __index = function(t, k) while true do end end }) return t.x

table.sort({ 3, 2, 1 }, function() while true do end end)

for _ in pairs(setmetatable({}, { __pairs = function() return function() return 1 end end })) do end

string.gsub(('x'):rep(10), 'x', function() while true do end end)

local t = {} for i = 1, 1e9 do t[i] = { i } end

local s = 'x' while true do s = s .. s end

return ('x'):rep(1 << 30)

local s = ('x'):rep(100, ('y'):rep(1e9))

local t = {} for i = 1, 1e5 do t = { t } end softvt.stable(t)

local n, piece = 0, ('local a = 1 '):rep(1e4)
load(function() n = n + 1 return n <= 100 and piece or nil end)

local text = ('-'):rep(2e6)
load(text)

error(load('return 7')(), 0)
