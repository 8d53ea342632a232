//! A box over a half-space: its corners.

use super::ManifoldPoint;
use crate::geometry::{Pose, Vec3, hex8};

/// The corners of a box of half extents `half` within `margin` of the half-space's face.
///
/// A corner's area is a quarter of each of its faces, as the half-space sees it: on a face that adds up to the face,
/// on an edge it changes smoothly from one face to the next.
pub(super) fn corners(plane_w: &Pose, half: &Vec3, box_w: &Pose, margin: f64, out: &mut Vec<ManifoldPoint>) {
    let n_w = plane_w.rotation * Vec3::z();
    let down = -(box_w.rotation.inverse() * n_w);
    let face = Vec3::new(half.y * half.z, half.x * half.z, half.x * half.y);
    for corner in 0..8u32 {
        let sign = hex8::corner_sign(corner as usize);
        let p_w = box_w * nalgebra::Point3::from(half.component_mul(&sign));
        let phi = n_w.dot(&(p_w.coords - plane_w.translation.vector));
        let area = (0..3).map(|axis| face[axis] * (sign[axis] * down[axis]).max(0.0)).sum::<f64>();
        if phi < margin && area > 0.0 {
            out.push(ManifoldPoint { p_w: p_w.coords - n_w * (0.5 * phi), n_w, phi, area, feature: corner });
        }
    }
}
