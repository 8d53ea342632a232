-- The best single closure for all instances of an asset, for a controller that knows the kind of an object, but neither sees nor feels how
-- large, stiff and heavy this one is.
local grasp = require "experts.grasp"

-- Instances per factor. Each stands for an equal share of the draws.
local STEPS = 9

local function uniform(range, share) return range[1] + share * (range[2] - range[1]) end
local function log_uniform(range, share) return range[1] * (range[2] / range[1]) ^ share end

-- The same object as another instance of its asset.
local function instance(object, scale, youngs_factor, density_factor)
  local ratio, size = scale / object.scale, {}
  for axis = 1, 3 do size[axis] = object.size[axis] * ratio end
  return {
    name = object.name, asset = object.asset, hints = grasp.scaled_hints(object.hints, ratio), size = size, scale = scale,
    youngs_factor = object.youngs_factor and youngs_factor, density_factor = object.density_factor and density_factor,
  }
end

-- Calls `visit` with instances that cover the ranges evenly.
local function each_instance(object, ranges, visit)
  for i = 1, STEPS do
    for j = 1, STEPS do
      for k = 1, STEPS do
        local function share(step) return (step - 0.5) / STEPS end
        visit(instance(
          object, uniform(ranges.size, share(i)), log_uniform(ranges.stiffness, share(j)), log_uniform(ranges.density, share(k))
        ))
      end
    end
  end
end

-- The closure in the largest number of intervals { from, to }: the middle of the first such range.
local function most_common(intervals)
  local ends = {}
  for _, interval in ipairs(intervals) do
    ends[#ends + 1] = { at = interval[1], step = 1 }
    ends[#ends + 1] = { at = interval[2], step = -1 }
  end
  -- An interval includes its ends.
  table.sort(ends, function(a, b) return a.at < b.at or a.at == b.at and a.step > b.step end)
  local count, most, best = 0, 0, nil
  for index, one in ipairs(ends) do
    count = count + one.step
    if count > most then most, best = count, (one.at + ends[index + 1].at) / 2 end
  end
  return best
end

-- Returns the closure that is within the safe windows of the largest share of the instances in `ranges` (softvt.InstanceRanges).
return function(object, ranges)
  local intervals = {}
  each_instance(object, ranges, function(other)
    local window = grasp.window(other)
    if not window then return end
    local from, to = grasp.command(window.loose), grasp.command(window.tight)
    if from <= to then intervals[#intervals + 1] = { from, to } end
  end)
  return most_common(intervals) or grasp.closure(instance(object, 1, 1, 1))
end
