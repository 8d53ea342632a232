//! Unit vectors that complete a given one to an orthonormal basis.

use nalgebra::{RealField, Vector3};

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
