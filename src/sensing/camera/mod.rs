//! Camera images: a deterministic software renderer in single precision.
//!
//! The rasteriser is written by hand, since two requirements rule out the alternatives. The benchmark runs on
//! machines without a GPU, and the same state must give byte-identical images on every machine and with every number
//! of threads. Graphics drivers, ray-tracing libraries and the platform's math functions all round differently from
//! one machine to the next.
//!
//! [`Renderer::render`] draws one image in these steps:
//!
//! 1. Objects are posed at the coarsest level of detail that looks like the finest one (`render::pass`, `mesh`).
//! 2. Triangles are projected, clipped and sorted into tiles of 32 × 32 pixels (`raster`).
//! 3. Each tile is rasterised with four samples per pixel into triangle ids and depths, and with one at the centre
//!    for depth and segmentation (`raster`).
//! 4. Each surface that a pixel shows is shaded once, eight points at a time (`render::tile`): Lambert and GGX under a
//!    key light with soft shadows and a sky (`shade`). In triangles of many pixels, light that changes linearly is
//!    interpolated between rows (`render::rows`).
//!
//! Materials are procedural functions of the object frame. [`RenderMesh`] bakes them into vertices or
//! textures once, filtered to the spacing of the samples. Objects that do not move, be they fixed or
//! [at rest](RestState), are drawn once for a camera that does not move either.
//!
//! # Example
//!
//! A red box on a floor, seen by the third-person camera:
//!
//! ```
//! use std::sync::Arc;
//! use softvt_common::disk_cache::DiskCache;
//! use softvt_geometry::{Pose, Vec3, shape::Shape};
//! use softvt_physics::BodyId;
//! use softvt_scene::{Camera, Lighting, Visual};
//! use softvt_sensing::camera::{FrameView, RenderMesh, RenderObject, RenderScene, Renderer};
//!
//! let object = |name: &str, id: u16, half: Vec3, colour: [f64; 3], z: f64| {
//!     let (shape, visual) = (Shape::Box { half }, Visual::plain(colour, 0.6, 0.0));
//!     let mesh = RenderMesh::from_shape(name, &shape, &[visual], &DiskCache::DISABLED)?;
//!     Ok::<_, softvt_sensing::camera::CameraError>(RenderObject {
//!         name: name.to_owned(),
//!         segmentation_id: id,
//!         mesh: Arc::new(mesh),
//!         body: BodyId::World,
//!         pose_in_body: Pose::translation(0.0, 0.0, z),
//!         casts_shadow: true,
//!     })
//! };
//! let floor = object("floor", 1, Vec3::new(0.5, 0.5, 0.01), [0.5; 3], -0.01)?;
//! let cube = object("cube", 2, Vec3::repeat(0.05), [0.7, 0.05, 0.05], 0.05)?;
//! let scene = RenderScene::new(vec![floor, cube], Lighting::default())?;
//!
//! let camera = Camera::third_person_table().with_edge(64);
//! let image = Renderer::default().render(&scene, &FrameView::default(), &camera)?;
//!
//! let pixel = image.segmentation.iter().position(|&id| id == 2).expect("the cube is in view");
//! let [red, green] = [image.rgb[3 * pixel], image.rgb[3 * pixel + 1]];
//! assert!(red > green && image.depth[pixel] < camera.far_m as f32);
//! # Ok::<(), softvt_sensing::camera::CameraError>(())
//! ```

// Each module uses only those before it: error, math, image, lens, raster, shade, mesh, scene, render.
mod error;
mod image;
mod lens;
mod math;
mod mesh;
mod raster;
mod render;
mod scene;
mod shade;

#[cfg(test)]
mod tests;

pub use self::image::{RenderedImage, encode_png};
pub use error::CameraError;
pub use lens::check_cameras;
pub use mesh::{
    display::DisplayMesh,
    lod::NodeWeights,
    primitive::{box_mesh, flat_faces},
    render_mesh::RenderMesh,
};
pub(crate) use mesh::{lod::Lod, render_mesh::RenderSolid};
pub use render::{Channels, Renderer};
pub use scene::{FrameView, RenderObject, RenderScene, RestState, check_light};
pub use softvt_signal::resize::resize;
