pub(crate) mod pose;
pub(crate) mod render_scene;
