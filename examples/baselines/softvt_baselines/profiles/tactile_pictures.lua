-- The profile visuo_tactile with the tactile picture of each finger in place of the mosaic of both.
return softvt.profile {
  name = "tactile_pictures",
  inputs = {
    { keys = { "image" }, source = "camera", camera = "third_person" },
    { keys = { "wrist_image" }, source = "camera", camera = "wrist" },
    { keys = { "left_tactile_image" }, source = "tactile", finger = "left" },
    { keys = { "right_tactile_image" }, source = "tactile", finger = "right" },
    { keys = { "state" }, source = "state", parts = { "position", "axis_angle", "finger_position" } },
    { keys = { "prompt" }, source = "prompt" },
    { keys = { "tactile_marker_motion" }, source = "marker_motion" },
    { keys = { "softvt" }, source = "query" },
  },
  actions = { pose = "absolute", gripper = { open = 0, closed = 1 } },
}
