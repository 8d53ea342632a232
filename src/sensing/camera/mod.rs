//! Pictures: a deterministic renderer for the processor, in single precision.
//!
//! An image is made tile by tile. Triangles are rasterised at four samples a pixel into triangle numbers and reciprocal
//! depths; then every surface that a pixel shows is lit once, eight points at a time: Lambert and GGX (Walter et al. 2007)
//! under one key light with soft shadows and a sky. Looks are baked into vertices, or into textures on large flat faces and on
//! all that is printed, when a [`RenderMesh`] is built, filtered to the spacing of its vertices; so that nothing is evaluated
//! twice and small images do not alias. Triangles that the look of a rigid thing does not need are taken out of it once.
//!
//! What does not move is drawn once for a camera that does not move either; see [`Renderer`].

mod error;
mod image;
mod lens;
mod mesh;
mod raster;
mod render;
mod scene;
mod shade;
mod simd;

#[cfg(test)]
mod tests;

pub use self::image::RenderedImage;
pub use error::CameraError;
pub use lens::check_cameras;
pub use mesh::{
    render_mesh::{RenderMesh, box_mesh, flat_faces},
    solid::{RenderSolid, Tessellation},
};
pub use render::Renderer;
pub use scene::render_scene::{Attachment, FrameView, RenderObject, RenderScene, check_light};

/// A point, direction or colour of a picture.
type V3 = nalgebra::Vector3<f32>;
