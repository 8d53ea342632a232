//! Signed-distance shapes, triangle and voxel meshes, surface samples, mass properties, and shared helpers.
//!
//! Lengths are in metres and points in the *object frame* (`_o`) unless stated otherwise. Shapes carry material ids, but
//! neither materials nor motion are part of this module. Closest points of convex shapes, mesh queries and the broad
//! phase use parry, whose vector types stay inside.

mod aabb;
mod basis;
pub mod convex;
pub mod hex8;
pub mod import;
pub mod mass;
pub mod mesh;
mod parry;
pub mod samples;
pub mod shape;
pub mod surface_mesh;
pub mod union_find;
pub mod voxel;

pub use aabb::{Aabb, GroupedAabb, overlapping_pairs};
pub use basis::{basis_from_reference, orthonormal_basis};

/// A point or vector, m unless stated otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3×3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A unit quaternion.
pub type Quat = nalgebra::UnitQuaternion<f64>;
/// A rigid transform (rotation and translation) from one frame to another.
pub type Pose = nalgebra::Isometry3<f64>;

#[cfg(test)]
mod tests;
