//! The scene to be drawn: objects, their poses in a state, and the light.

pub(crate) mod pose;
pub(crate) mod render_scene;
