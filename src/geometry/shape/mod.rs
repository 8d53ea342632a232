//! Composable signed-distance shapes.
//!
//! A [`Shape`] is a tree: primitives at the leaves, placements, combinations and warps above them. Every node gives its
//! signed distance and outward unit normal ([`Shape::distance_and_normal`]): exact where the node allows it, otherwise
//! found by projection on the surface.

mod bounds;
mod combine;
mod contact;
mod displacement;
mod distance;
mod mesh_solid;
mod paint;
mod polygon;
mod primitive;
mod tree;
mod validate;
mod warp;

pub(crate) use combine::SignedDistance;
pub use contact::SampleContact;
pub use displacement::{Bumps, Ramp, Ridges, SurfaceRelief};
pub use mesh_solid::{MeshPoint, MeshSolid};
pub use polygon::Polygon;
pub use tree::{Shape, ShapeTreeSize};
pub use validate::ShapeError;
pub use warp::Axis;
