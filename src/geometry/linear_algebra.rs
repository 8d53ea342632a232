//! Types of vectors, matrices and transforms, and orthonormal bases.

use nalgebra::{RealField, Vector3};

/// A point or vector, m unless stated otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3×3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A rotation, as a unit quaternion.
pub type Quat = nalgebra::UnitQuaternion<f64>;
/// A rigid transform (rotation and translation) from one frame to another.
pub type Pose = nalgebra::Isometry3<f64>;

/// Unit vectors `[u, v]` such that `u`, `v`, `n` is a right-handed orthonormal basis.
///
/// `u` is perpendicular to the coordinate axis along which the unit vector `n` is smallest. The basis jumps where that
/// axis changes: use it where the direction of `u` about `n` does not matter.
pub fn orthonormal_basis<T: RealField + Copy>(n: &Vector3<T>) -> [Vector3<T>; 2] {
    basis_from_reference(n, &Vector3::ith(n.iamin(), T::one()))
}

/// As [`orthonormal_basis`], with `u` along `reference × n`; `reference` must not be parallel to `n`.
pub fn basis_from_reference<T: RealField + Copy>(n: &Vector3<T>, reference: &Vector3<T>) -> [Vector3<T>; 2] {
    let u = reference.cross(n).normalize();
    [u, n.cross(&u)]
}
