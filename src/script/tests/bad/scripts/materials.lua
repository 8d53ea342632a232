-- Visuals of the library, and masks of every kind.
local small = require 'small' local mask, material = softvt.mask, require 'materials'
local function asset(visual) return softvt.asset { name = 'bun', shape = softvt.shape.sphere { radius = 0.03 }:grounded(), body = softvt.scenery {}, visuals = { visual } } end
local function layer(mask) return { albedo = { 1, 1, 1 }, layers = { { albedo = { 0, 0, 0 }, mask = mask } } } end
local bun = asset(...) return small.suite { build = function(scene) scene:add { name = 'bun', asset = bun, position = { 0, 0, 0 } } end }
---
layer(mask.checker { size_m = 0.01 })

layer(mask.stripes { axis = { 1, 1, 0 }, pitch_m = 0.01 })

layer(mask.gradient { axis = 'y', from_m = 0.02, to_m = 0.01 })

layer(mask.noise { size_m = { 0.01, 0.02, 0.03 } })

layer(mask.rings { centre_m = { 0, 0, 0 }, pitch_m = 0.01 })

layer(mask.boards { length_m = 0.5, width_m = 0.1 })

layer(mask.seams { length_m = 0.5, width_m = 0.1, gap_m = 1e-3 })

layer(mask.specks { spacing_m = 0.01, radius_m = 1e-3 })

layer(mask.weave { pitch_m = 1e-3 })

layer(mask.facing { from = 0.2, to = 0.8 })

layer(mask.inside { shape = softvt.shape.sphere { radius = 0.01 }, soft_m = 1e-3 })

layer(mask.text { text = 'Ünder', height_m = 5e-3, at = { 0, 0, 0.03 }, facing = '-y', wrap_m = 0.03, weight = 0.1, font = 'mono' })

material.crust {}

material.dough {}

material.frosting {}

material.foam {}

material.silicone {}

material.seeds {}

material.ceramic {}

material.wood {}

material.floorboards {}

material.steel {}

material.fabric {}

material.paint {}

material.floured(material.crust {}, {})
