-- LIBERO's interface; equals the built-in profile libero. A starting point for your own profile.
--
--   softvt suites/object_soft.lua --policy ws://host:8000 --profile scripts/profiles/libero.lua
return softvt.profile {
  name = "libero",
  inputs = {
    { keys = { "observation/image" }, source = "camera", camera = "third_person", half_turn = true },
    { keys = { "observation/wrist_image" }, source = "camera", camera = "wrist", half_turn = true },
    { keys = { "observation/state" }, source = "state", parts = { "position", "axis_angle", "finger_pair" } },
    { keys = { "prompt" }, source = "prompt" },
    { keys = { "softvt" }, source = "query" },
    { keys = { "__softvtbench_rng_seed" }, source = "query_seed" },
  },
  actions = {
    pose = "delta_osc",
    translation_m = 0.05,
    rotation_rad = 0.5,
    gripper = { open = -1, closed = 1, code = "binary" },
  },
}
