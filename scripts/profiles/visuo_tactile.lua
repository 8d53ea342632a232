-- Both cameras, state, prompt and touch with absolute poses; equals the built-in profile visuo_tactile. A starting
-- point for your own profile.
--
--   softvt suites/object_soft.lua --policy ws://host:8000 --profile scripts/profiles/visuo_tactile.lua
local function both(name) return { "observation/" .. name, name } end

return softvt.profile {
  name = "visuo_tactile",
  inputs = {
    { keys = both "image", source = "camera", camera = "third_person" },
    { keys = both "wrist_image", source = "camera", camera = "wrist" },
    { keys = both "state", source = "state", parts = { "position", "axis_angle", "sensed_finger_position" } },
    { keys = { "prompt" }, source = "prompt" },
    { keys = both "tactile_image", source = "tactile_image" },
    { keys = both "tactile_marker_motion", source = "marker_motion" },
    { keys = { "softvt" }, source = "query" },
    { keys = { "__softvtbench_rng_seed" }, source = "query_seed" },
  },
  actions = { pose = "absolute", gripper = { open = 0, closed = 1 } },
}
