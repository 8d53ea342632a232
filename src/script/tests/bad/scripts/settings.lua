-- Settings of a suite.
local suite = require 'small'.suite {} suite.settings = ... return suite
---
{ robot = { gripper = { effort = 20 }, latency = 2 }, physics = { dt = 1 / 60 } }

{ robot = { gripper = { efort = 0.2 } } }

{ tactile = { gels = {} } }

{ physics = { dt = { x = 1 } } }

{ robot = { latency = 2.5 } }

{ robot = { latency = -1 } }

{ robot = { latency = 'fast' } }

{ physics = { dt = -1 } }

{ physics = { dt = 0.02 } }

{ physics = { dt = '1/60' } }

{ physics = { dt = true } }

{ physics = { margin = 1e300 } }

{ criteria = { require_no_slip = 1 } }

{ robot = { pads = { static_mu = 0 } } }

{ robot = { pads = { static_mu = 0, dynamic_mu = 0 } } }

{ tactile = { markers = { model = 'fots', scale = 15.77 } } }

{ tactile = { markers = { dilate = 0.1 } } }

{ tactile = { markers = { model = 'elastic', dilate = 1 } } }

{ tactile = { optics = { model = 'tracim' } } }

{ tactile = { optics = { model = 'taxim' } } }
