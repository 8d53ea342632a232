-- Inputs of a profile.
return softvt.profile { name = 'mine', inputs = { { keys = { 'image' }, source = 'camera', camera = 'third_person' }, ... },
actions = { pose = 'delta_osc', translation_m = 0.05, rotation_rad = 0.5, gripper = { open = -1, closed = 1, code = 'binary' } } }
---
{ keys = { 'prompt' }, source = 'prompt' }

{ keys = { 'prompt' }, source = 'promt' }

{ keys = { 'state' }, source = 'state', parts = { 'position', 'axis_angle', 'finger_pairs' } }

{ keys = { 'state' }, source = 'state', parts = { 'position', 'axis_angle', 'position' } }

{ keys = { 'wrist' }, source = 'camera' }

{ keys = { 'prompt' }, source = 'prompt', camera = 'wrist' }

{ keys = { 'image' }, source = 'prompt' }

{ keys = {}, source = 'prompt' }
