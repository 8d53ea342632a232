//! Preparation of meshes for drawing: triangulation of shapes, materials baked into vertices or textures,
//! and levels of detail.

pub(crate) mod bake;
pub(crate) mod lathe_mesh;
pub(crate) mod lod;
pub(crate) mod primitive_mesh;
pub(crate) mod render_mesh;
pub(crate) mod simplify;
pub(crate) mod solid;
pub(crate) mod texture_chart;
pub(crate) mod uv_atlas;
