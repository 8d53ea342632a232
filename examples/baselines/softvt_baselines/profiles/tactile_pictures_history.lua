-- The profile visuo_tactile with the tactile picture of each finger in place of the mosaic of both, of the last two control steps.
return softvt.profile {
  name = "tactile_pictures_history",
  inputs = {
    { keys = { "image" }, source = "camera", camera = "third_person", frames = 2 },
    { keys = { "wrist_image" }, source = "camera", camera = "wrist", frames = 2 },
    { keys = { "left_tactile_image" }, source = "tactile", finger = "left", frames = 2 },
    { keys = { "right_tactile_image" }, source = "tactile", finger = "right", frames = 2 },
    { keys = { "state" }, source = "state", parts = { "position", "axis_angle", "finger_position" }, frames = 2 },
    { keys = { "prompt" }, source = "prompt" },
    { keys = { "tactile_marker_motion" }, source = "marker_motion" },
    { keys = { "softvt" }, source = "query" },
  },
  actions = { pose = "absolute", gripper = { open = 0, closed = 1 } },
}
