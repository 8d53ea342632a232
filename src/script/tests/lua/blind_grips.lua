local blind_grips, grasp = require "experts.blind_grips", require "experts.grasp"
local function instance(scale, youngs_factor, density_factor)
  return { name = "ball", asset = "sphere", scale = scale, youngs_factor = youngs_factor, density_factor = density_factor,
    hints = {}, size = { 0.06 * scale, 0.06 * scale, 0.06 * scale }, draws = 1 }
end
-- Instances by a low-discrepancy sequence (additive recurrence) that begins at `first`.
local function drawn(first, size)
  local instances = {}
  function instances:sample(object, count)
    local list = {}
    for k = first, first + count - 1 do
      local function share(step) return (0.5 + k * step) % 1 end
      local scale = size[1] + (size[2] - size[1]) * share(0.8191725)
      list[#list + 1] = instance(scale, 0.5 * 4 ^ share(0.6710436), 0.6 * 3 ^ share(0.5497005))
    end
    return list
  end
  function instances:kinds() return { "sphere" } end
  return instances
end
local size = { 0.88, 1.12 }
local function best(name, size) return blind_grips.best(name, blind_grips.sample(name, drawn(1, size), "ball")) end

-- No other closure is safe for more instances, up to the error of a sample; knowing the size is worth something.
local others = blind_grips.sample("fixed-closure", drawn(5000, size), "ball")
local fixed, most = best("fixed-closure", size), 0
for closure = 0.2, 0.6, 0.01 do
  most = math.max(most, blind_grips.share({ value = closure, size_power = 0, of = fixed.of }, others))
end
local own = blind_grips.share(fixed, others)
assert(own >= most - 0.03 and own < 0.95, ("%g of at most %g"):format(own, most))
assert(math.abs(own - fixed.share) < 0.05, "the share of the sample it was chosen on")
assert(blind_grips.share(best("size-seen", size), others) > own + 0.2)

-- Of instances that differ in the size alone, a closure by size suits more than any one closure.
local alike = {}
function alike:sample(object, count)
  local list = {}
  for k = 1, count do list[k] = instance(0.88 + 0.24 * k / count, 1, 1) end
  return list
end
local function share(name) return blind_grips.best(name, blind_grips.sample(name, alike, "ball")).share end
assert(share("size-seen") == 1 and share("fixed-closure") < 0.9, share("fixed-closure"))

-- A hand with softer drives has to be commanded further for the same grips.
local soft = blind_grips.sample("size-seen", drawn(1, size), "ball", nil, 1000)
assert(blind_grips.best("size-seen", soft).value > best("size-seen", size).value)
return suite(pair)
