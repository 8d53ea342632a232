-- The profile vision with the pictures and states of the last two control steps.
return softvt.profile {
  name = "vision_history",
  inputs = {
    { keys = { "image" }, source = "camera", camera = "third_person", frames = 2 },
    { keys = { "wrist_image" }, source = "camera", camera = "wrist", frames = 2 },
    { keys = { "state" }, source = "state", parts = { "position", "axis_angle", "finger_position" }, frames = 2 },
    { keys = { "prompt" }, source = "prompt" },
    { keys = { "softvt" }, source = "query" },
  },
  actions = { pose = "absolute", gripper = { open = 0, closed = 1, code = "binary" } },
}
