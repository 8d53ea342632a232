//! Queries of the distance field of one body at points of another.

use super::ManifoldPoint;
use softvt_geometry::{Aabb, Pose, Vec3, shape::Shape};

/// The distance field of the second body, evaluated at points of the first.
pub(super) struct SdfProbe<'a> {
    pub shape_b: &'a Shape,
    pub bounds_b: &'a Aabb,
    /// The first body's frame in the second's.
    pub a_in_b: Pose,
    pub pose_b: &'a Pose,
}

impl SdfProbe<'_> {
    /// True if `p_a` is farther than `reach` (m) from the bounds of the second body.
    pub(super) fn is_beyond(&self, p_a: &Vec3, reach: f64) -> bool {
        let p_b = self.a_in_b * nalgebra::Point3::from(*p_a);
        !self.bounds_b.loosened(reach).contains(&p_b.coords)
    }

    /// Gap at `p_a` (first body's frame, m), m.
    pub(super) fn gap(&self, p_a: &Vec3) -> f64 {
        self.shape_b.distance_and_normal(&(self.a_in_b * nalgebra::Point3::from(*p_a)).coords).0
    }

    /// Gap at `p_a` (m) and its gradient, in the first body's frame.
    pub(super) fn gap_and_gradient(&self, p_a: &Vec3) -> (f64, Vec3) {
        let (gap, n_b) =
            self.shape_b.distance_and_normal(&(self.a_in_b * nalgebra::Point3::from(*p_a)).coords);
        (gap, self.a_in_b.rotation.inverse_transform_vector(&n_b))
    }

    /// The contact point at `p_a` on the first body's surface.
    pub(super) fn contact(&self, p_a: &Vec3, area: f64, feature: u32) -> ManifoldPoint {
        let p_b = self.a_in_b * nalgebra::Point3::from(*p_a);
        let (gap, n_b) = self.shape_b.distance_and_normal(&p_b.coords);
        let normal_w = -(self.pose_b.rotation * n_b);
        // `p_a` is on the first surface; the second is one gap further along the normal.
        let position_w = (self.pose_b * p_b).coords + normal_w * (0.5 * gap);
        ManifoldPoint { position_w, normal_w, gap, area, feature }
    }
}

/// The minimum of a unimodal function in `start..start + width`: golden sections, then the parabola through three
/// points around the best.
pub(super) fn golden_minimum(f: impl Fn(f64) -> f64, start: f64, width: f64) -> f64 {
    const SHARE: f64 = 0.381_966_011_250_105;
    let (mut low, mut high) = (start, start + width);
    let (mut x, mut y) = (low + SHARE * width, high - SHARE * width);
    let (mut fx, mut fy) = (f(x), f(y));
    for _ in 0..14 {
        if fx < fy {
            (high, y, fy) = (y, x, fx);
            x = low + SHARE * (high - low);
            fx = f(x);
        } else {
            (low, x, fx) = (x, y, fy);
            y = high - SHARE * (high - low);
            fy = f(y);
        }
    }
    let (middle, h) = (0.5 * (low + high), 0.1 * width);
    let (before, here, after) = (f(middle - h), f(middle), f(middle + h));
    let bend = before - 2.0 * here + after;
    let shift = if bend > 0.0 { 0.5 * h * (before - after) / bend } else { 0.0 };
    middle + if f(middle + shift) < here { shift } else { 0.0 }
}
