//! What sensors see: pure functions of a state and a scene.

pub mod camera;
