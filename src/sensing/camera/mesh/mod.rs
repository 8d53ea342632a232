//! Preparation of meshes for drawing: triangulation of shapes, materials baked into vertices or textures,
//! and levels of detail.

pub(crate) mod display;
pub(crate) mod lod;
pub(crate) mod primitive;
pub(crate) mod render_mesh;
pub(crate) mod simplify;
pub(crate) mod texture;
