//! Pictures: a deterministic renderer for the processor, in single precision.
//!
//! An image is made tile by tile. Triangles are rasterised at four samples a pixel into triangle numbers and reciprocal
//! depths; then every surface that a pixel shows is lit once, eight points at a time: Lambert and GGX (Walter et al. 2007)
//! under one key light with soft shadows and a sky. Looks are baked into vertices, or into textures on large flat faces and on
//! all that is printed, when a [`Model`] is built, filtered to the spacing of its vertices; so that nothing is evaluated
//! twice and small images do not alias. Triangles that the look of a rigid thing does not need are taken out of it once.
//!
//! What does not move is drawn once for a camera that does not move either; see [`Scratch`].

mod background;
mod charts;
mod decimate;
mod error;
mod facet;
mod frame;
mod lanes;
mod lens;
mod model;
mod noise;
mod parts;
mod pass;
mod pattern;
mod picture;
mod pose;
mod raster;
mod render;
mod screen;
mod shade;
mod shadow;
mod solids;
mod stage;
mod surface;
mod text;
mod tile;
mod tone;
mod turned;

#[cfg(test)]
mod tests;

pub use error::CameraError;
pub use lens::check_cameras;
pub use model::{Model, box_mesh, flat_faces};
pub use picture::Picture;
pub use render::{Scratch, render};
pub use solids::{Form, Solid};
pub use stage::{FrameView, Mount, Stage, Thing, check_light};

/// A point, direction or colour of a picture.
type V3 = nalgebra::Vector3<f32>;
