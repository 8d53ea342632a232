-- A profile with entries of several control steps, and of every kind of image.
return softvt.profile {
  name = "history",
  inputs = {
    { keys = { "observation/state" }, source = "state", parts = { "position", "axis_angle", "closure" } },
    { keys = { "two" }, source = "camera", camera = "wrist", frames = 2 },
    { keys = { "one" }, source = "camera", camera = "wrist", frames = 1 },
    { keys = { "depth" }, source = "depth", camera = "wrist" },
    { keys = { "objects" }, source = "segmentation", camera = "wrist", frames = 3 },
    { keys = { "arm" }, source = "state", parts = { "joints", "joint_velocities", "joint_torques" }, frames = 4 },
    { keys = { "markers" }, source = "marker_motion", frames = 2 },
    { keys = { "drawn" }, source = "tactile", finger = "left", markers = "black_arrows", frames = 2 },
    { keys = { "mosaic" }, source = "tactile_image", markers = "dots" },
    { keys = { "id" }, source = "query" },
    { keys = { "seed" }, source = "query_seed" },
  },
  actions = { pose = "absolute", gripper = { open = 0, closed = 1 } },
  observe_every_step = false,
}
