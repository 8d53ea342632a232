//! Signed-distance shapes, triangle and voxel meshes, surface samples, mass properties, and shared helpers.
//!
//! Lengths are in metres and points in the *object frame* (`_o`) unless stated otherwise. Shapes carry material ids,
//! but neither materials nor motion are part of this module. Closest points of convex shapes, mesh queries and the
//! broad phase use parry, whose vector types stay inside.
#![warn(missing_docs, unreachable_pub)]

mod aabb;
mod bilinear_grid;
pub mod cavity;
pub mod convex;
pub mod hex8;
pub mod import;
mod linear_algebra;
pub mod mass;
pub mod mesh;
mod mesh_overlap;
mod parry;
pub mod pieces;
pub mod samples;
pub mod shape;
pub mod surface_mesh;
pub mod union_find;
pub mod voxel;
pub mod walls;

pub use aabb::{Aabb, GroupedAabb, overlapping_pairs};
pub use bilinear_grid::BilinearGrid;
pub use linear_algebra::{Mat3, Pose, Quat, Vec3, basis_from_reference, orthonormal_basis};

#[cfg(test)]
mod tests;
