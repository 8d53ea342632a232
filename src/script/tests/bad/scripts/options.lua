-- Options of a script, given on its command line.
local opt = softvt.options {
  closure = { default = 0.5, unit = "1", min = 0, max = 1, help = "how far to close" },
  gap_mm = { default = { 48, 46 }, unit = "mm", min = 1 },
  count = { default = 3, integer = true },
  shape = { default = "cube", choices = { "cube", "sphere" } },
  fast = { default = false },
}
return softvt.experiment { name = "e", options = opt, grid = { gap = opt.gap_mm }, run = function(point) return { ... } end }
---
-- argv: --closure=abc
closure = opt.closure

-- argv: --closure 2
closure = opt.closure

-- argv: --closure nan
closure = opt.closure

-- argv: --closure
closure = opt.closure

-- argv: --closure=0 --closure=1
closure = opt.closure

-- argv: --closre=0
closure = opt.closure

-- argv: --count 1.5
count = opt.count

-- argv: --shape cone
shape = opt.shape

-- argv: --fast=maybe
fast = opt.fast

-- argv: --gap-mm 48,0.5
gap = point.gap

-- argv: 0.3
gap = point.gap

-- argv: --closure 0.3
closure = opt.closure

-- argv: --closure=0.3
closure = opt.closure

closure = opt.closure, fast = opt.fast, shape = opt.shape, gap = point.gap

-- argv: --gap-mm 42,40
gap = point.gap

-- argv: --gap_mm=42
gap = point.gap

-- argv: --fast
fast = opt.fast

-- argv: --fast=on
fast = opt.fast

-- argv: --no-fast
fast = opt.fast

-- argv: --shape sphere
shape = opt.shape
