-- Layers of visuals and their masks.
local mask = softvt.mask
softvt.asset { name = "bun", shape = softvt.shape.sphere { radius = 0.03 }, body = softvt.scenery {}, visuals = { { albedo = { 1, 1, 1 }, layers = { { ... } } } } }
---
albedo = { 2, 0, 0 },

albedo = { 1, 0, 0 }, rougness = 1,

albedo = { 1, 0, 0 }, opacity = 1.5,

albedo = { 1, 0, 0 },
relief_m = 1,

albedo = { 1, 0, 0 }, mask = { kind = "noise" },

mask = mask.noise { size_m = 0 },

mask = mask.noise { size_m = { 1, 0, 1 } },

mask = mask.noise { size_m = 1, from = 0.5, to = 0.5 },

mask = mask.gradient { axis = { 0, 0, 0 }, from_m = 0, to_m = 1 },

mask = mask.text { text = 'a\u{6f22}', height_m = 0.01, at = { 0, 0, 0 }, facing = '+z' },

mask = mask.text { text = ('x'):rep(65), height_m = 0.01, at = { 0, 0, 0 }, facing = '+z' },

mask = mask.text { text = '\xff', height_m = 0.01, at = { 0, 0, 0 }, facing = '+z' },

mask = mask.text { text = 'x', height_m = 0.01, at = { 0, 0, 0 }, facing = { 0, 0, 0 } },

mask = mask.text { text = 'x', height_m = 0.01, at = { 0, 0, 0 }, facing = '+z', wrap_m = 0.1 },

mask = mask.specks { spacing_m = 1, radius_m = 0.6 },

mask = mask.specks { spacing = 1 },
