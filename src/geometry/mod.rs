//! Shapes and meshes: signed-distance shapes, imported meshes, skins, voxel meshes and surface samples.
//!
//! Everything here is in the *object frame* (`_o`), in metres, and knows nothing of materials or motion.

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

/// A point or vector, m unless said otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3×3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A unit quaternion.
pub type Quat = nalgebra::UnitQuaternion<f64>;
/// A rigid placement (rotation and translation).
pub type Pose = nalgebra::Isometry3<f64>;

#[cfg(test)]
mod tests;
