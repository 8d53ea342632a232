-- Functions of prompts, which return a text and leave the scene.
local small = require 'small'
return small.suite { episode_prompt = function(scene, rng) ... end }
---
return 'lift it'

return nil

return ''

return '  '

return ('x'):rep(5000)

return 'lift \t'

scene:object('ball').yaw = 1 return 'lift'

error('no')

while true do end
