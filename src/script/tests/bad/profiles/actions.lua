-- Actions of a profile.
return softvt.profile { name = 'mine', inputs = { { keys = { 'prompt' }, source = 'prompt' } }, actions = { ... } }
---
pose = 'absolute', gripper = { open = -1, closed = 1, code = 'binary' }

pose = 'delta_osc', rotation_rad = 0.5, gripper = { open = -1, closed = 1, code = 'binary' }

pose = 'delta_osc', translation_m = 0.05, rotation_rad = 0/0, gripper = { open = -1, closed = 1, code = 'binary' }

pose = 'absolute', translation_m = 0.05, gripper = { open = -1, closed = 1, code = 'binary' }

pose = 'delta', translation_m = 0.05, rotation_rad = 0.5, scale = { 1, 1, 1 }, gripper = { open = -1, closed = 1, code = 'binary' }

pose = 'joints', length = 7, gripper = { open = -1, closed = 1, code = 'binary' }

pose = 'absolute', gripper = { open = 1, closed = 1, code = 'binary' }

pose = 'absolute', gripper = { open = -1, closed = 1, code = 'two-widths' }

pose = 'absolute', gripper = { open = -1, closed = 1, code = 'force' }

pose = 'absolute', gripper = { closed = 1, code = 'binary' }
