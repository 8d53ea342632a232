-- Files that declare no policy, and policies whose actions have another grip code or need what they do not observe.
local pose = { position = { 0.5, 0, 0.25 }, axis_angle = { 3, 0, 0 } }
---
return 3

return softvt.policy { name = 'p' }

return softvt.policy { name = 'p', act = print, observes = { tactil = true } }

return softvt.policy { name = 'p', act = print,
  replan = 0 }

x = = 1

return softvt.policy { name = 'p', act = print, gripper = 'twowidth' }

return softvt.policy { name = 'p', gripper = 'force', act = function() pose.closure = 0.6 return pose end }

return softvt.policy { name = 'p', gripper = 'binary', act = function() pose.force = 2.5 return pose end }

return softvt.policy { name = 'p', act = function(obs)
  return obs.closure end }

local sources = require 'strain_sources'
return softvt.policy { name = 'p', act = print }

local grasp = require 'experts.grasp'
return softvt.policy { name = 'p', act = print }

local pick_place = require 'experts.pick_place'
return softvt.policy { name = 'p', act = print }

local cube = require 'assets.cube'
return softvt.policy { name = 'p', act = print }

local own = require 'assets.own'
return softvt.policy { name = 'p', act = print }
-- file: assets/own.lua
return { body = { youngs_pa = 1 } }

local limit = softvt.calibration 'cube'
return softvt.policy { name = 'p', act = print }

local soft = softvt.soft { youngs_pa = 1e4, poisson = 0.3, density = 300 }
return softvt.policy { name = 'p', act = print }

local route = require 'experts.route'
return softvt.policy { name = 'p', act = function() pose.closure = 1 return pose end }

-- Without the drives, the width is the one of a real hand.
return softvt.policy { name = 'p', act = function(obs) assert(obs.width == 0.0624) pose.closure = 1 return pose end }

local sources = require 'strain_sources'
return softvt.policy { name = 'p', privileged = true, act = function() pose.closure = 0 return pose end }

local grasp = require 'experts.grasp'
return softvt.policy { name = 'p', privileged = true, act = function() pose.closure = 0 return pose end }

local cube = require 'assets.cube'
return softvt.policy { name = 'p', privileged = true, act = function() pose.closure = 0 return pose end }

local limits = softvt.calibration 'cube'
return softvt.policy { name = 'p', privileged = true, act = function() pose.closure = 0 return pose end }

local soft = softvt.soft { youngs_pa = 1e4, poisson = 0.3, density = 300 }
return softvt.policy { name = 'p', privileged = true, act = function() pose.closure = 0 return pose end }
