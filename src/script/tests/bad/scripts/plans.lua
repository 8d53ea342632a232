-- What scripts return, and suites that are invalid as a whole.
local small = require 'small' local layout = softvt.layout('l', function() end)
---
return 3

-- nothing

return {}

return softvt.suite {
  name = 's', object_type = 'rigid', tasks_differ_in = 'spatial',
  tasks = {},
}

local function task(prompt)
  return softvt.task { prompt = prompt, layout = layout, goal = small.goal }
end
return softvt.suite { name = 's', object_type = 'rigid', tasks_differ_in = 'spatial',
  tasks = { task 'p', task 'q', task 'p' } }

local goal = softvt.inside { object = 'a',
  target = 'a' }
return small.suite { goal = goal }

return softvt.suite {
  name = 'a', object_type = 'deformable', tasks_differ_in = 'spatial', tasks = small.suite({}).tasks,
  settings = { robot = { gripper = { kpp = 1 } } },
}

return softvt.suite {
  name = 'a', object_type = 'deformable', tasks_differ_in = 'spatial', tasks = small.suite({}).tasks,
  settings = { nonsense = { a = 1 } },
}

return softvt.suite {
  name = 'a', object_type = 'deformable', tasks_differ_in = 'spatial', tasks = small.suite({}).tasks,
  settings = { physics = { dt = 'a' } },
}

return softvt.suite {
  name = 'a', object_type = 'deformable', tasks_differ_in = 'spatial', tasks = small.suite({}).tasks,
  settings = { physics = { dt = 0.4 } },
}

return small.suite { prompt = 'a\n' }

return small.suite { prompt = 'a\u{202E}' }

return small.suite { prompt = ('x'):rep(5000) }

local s = small.suite {}
s.tasks = nil
return s

local s = small.suite {}
s.tasks[1].prompt = 3
return s

local s = small.suite {}
s.tasks[1].goal.hold_s = 'x'
return s

local s = small.suite {}
s.tasks[1].layout.build = 1
return s

local s = small.suite {}
s.tasks[1] = setmetatable({}, { __index = function() while true do end end })
return s

-- A list of suites holds nothing else.
return { small.suite {}, 3 }
