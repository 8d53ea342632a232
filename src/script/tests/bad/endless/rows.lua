-- Experiments whose objects or rows would take all memory, or are no data.
return softvt.experiment { name = 'e', grid = { a = { 1 } }, run = function() ... end }
---
local x = softvt.mask.weave { pitch_m = 1 }
for i = 1, 64 do x = x:intersect(x) end

local x = softvt.mask.weave { pitch_m = 1 }
for i = 1, 64 do x = x:inverted():intersect(x:inverted()) end

local x = softvt.shape.sphere { radius = 1 }
for i = 1, 64 do x = x:union(x) end

local x = softvt.shape.sphere { radius = 1 }
for i = 1, 64 do x = x:smooth_union(x, 0.1) end

local x = softvt.shape.sphere { radius = 1 }
for i = 1, 64 do x = x:intersect(x) end

local x = softvt.shape.sphere { radius = 1 }
for i = 1, 64 do x = x:subtract(x) end

local x = softvt.shape.sphere { radius = 1 }
for i = 1, 64 do x = x:subtract(x, 0.1) end

local x = softvt.shape.sphere { radius = 1 }
for i = 1, 64 do x = x:paint { material = 1, region = x } end

local x = softvt.shape.sphere { radius = 1 }
for i = 1, 200 do x = x:round(0.1) end

local s = softvt.shape.sphere { radius = 1 }
local x = s
for i = 1, 20 do x = x:subtract(s) end

local x = softvt.shape.sphere { radius = 1 }
for i = 1, 300 do x = x:union(x.sphere) end

local s = softvt.shape.sphere { radius = 1 }
local x = s
for i = 1, 300 do x = x:union(s):translate(0, 0, 0) end

local s = softvt.shape.sphere { radius = 1 }
local x = s
for i = 1, 300 do x = x:union(s) end
return { fine = true }

local kept = {}
for i = 1, 1e9 do kept[i] = softvt.image { width = 4096, height = 4096, colour = { 0, 0, 0 } } end

local big, kept = softvt.image { width = 4096, height = 4096, colour = { 0, 0, 0 } }, {}
for i = 1, 1e9 do kept[i] = big:crop { 0, 0, 4096, 4096 } end

for i = 1, 12 do local p = softvt.image { width = 4096, height = 4096, colour = { 0, 0, 0 } } end
return { released = true }

local soft = softvt.soft { youngs_pa = 1e4, poisson = 0.3, density = 300, grasp_spacing = 0.005, resolution = 28 }
local ball, kept = softvt.shape.sphere { radius = 0.01 }, {}
for i = 1, 1e9 do kept[i] = softvt.world {}:soft { name = 'b', shape = ball, position = { 0, 0, 0 }, body = soft } end

local soft = softvt.soft { youngs_pa = 1e4, poisson = 0.3, density = 300, grasp_spacing = 0.005, resolution = 28 }
local ball = softvt.shape.sphere { radius = 0.01 }
for i = 1, 12 do local body = softvt.world {}:soft { name = 'b', shape = ball, position = { 0, 0, 0 }, body = soft } end
return { released = true }

local ball, kept = softvt.shape.sphere { radius = 1 }, {}
for i = 1, 20 do kept[i] = softvt.world {}:static { name = 's', shape = ball, position = { 0, 0, 0 } } end
return { fine = true }

local t = {} t.t = t
return { a = t }

local t = { 1 }
for i = 1, 30 do t = { t, t } end
return { a = t }

return { depth = 1/0 }

return { { a = 1 }, { b = { c = 0/0 } } }

return { a = softvt.pose { position = { 0, 0, 0 } } }

return { a = softvt.pose { position = { 1, 2, 3 } }.position }

return { a = ('x'):rep(6e5), b = ('x'):rep(6e5) }

local row, rows = { a = ('x'):rep(1e6) }, {}
for i = 1, 300 do rows[i] = row end
return rows
