-- The best single closure for all instances of an asset, for a controller that knows the kind of an object, but neither sees nor feels how
-- large, stiff and heavy this one is.
local grasp = require "experts.grasp"

-- Number of instances to choose from.
local COUNT = 600

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

-- Returns the closure that is within the safe windows of the largest share of the instances (softvt.Instances).
return function(object, instances)
  local intervals = {}
  for _, other in ipairs(instances:sample(object.name, COUNT)) do
    local window = grasp.window(other)
    local from, to = window and grasp.command(window.loose), window and grasp.command(window.tight)
    if window and from <= to then intervals[#intervals + 1] = { from, to } end
  end
  return most_common(intervals) or grasp.closure(object)
end
