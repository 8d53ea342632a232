//! Coordinate axes, and the inverse maps of warps along them: from a point of the warped shape to the point of the
//! straight one, with the Jacobian that transforms gradients.

use serde::Serialize;

use crate::{Mat3, Vec3};

/// A coordinate axis of a shape's frame.
/// Its serialised names are part of fingerprints of assets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Axis {
    /// Axis x of the frame of the shape.
    X,
    /// Axis y of the frame of the shape.
    Y,
    /// Axis z of the frame of the shape.
    Z,
}

impl Axis {
    /// Index of the coordinate: 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Unit vector along the axis.
    pub fn unit(self) -> Vec3 {
        Vec3::ith(self.index(), 1.0)
    }
}

/// Point of the straight shape, and the Jacobian ∂(straight)/∂(twisted), of a twist of `rate` rad/m about `axis`.
pub(super) fn untwist(p: &Vec3, axis: Axis, rate: f64) -> (Vec3, Mat3) {
    let k = axis.index();
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let (sin, cos) = (-rate * p[k]).sin_cos();
    let mut straight = *p;
    straight[i] = cos * p[i] - sin * p[j];
    straight[j] = sin * p[i] + cos * p[j];
    let mut jacobian = Mat3::identity();
    (jacobian[(i, i)], jacobian[(i, j)]) = (cos, -sin);
    (jacobian[(j, i)], jacobian[(j, j)]) = (sin, cos);
    (jacobian[(i, k)], jacobian[(j, k)]) = (rate * straight[j], -rate * straight[i]);
    (straight, jacobian)
}

/// Point of the straight shape, and the Jacobian ∂(straight)/∂(bent), of a bend. The coordinate `along` becomes the
/// angle about the centre of the arc times its radius, `towards` the remaining distance to the arc.
pub(super) fn unbend(p: &Vec3, along: Axis, towards: Axis, curvature: f64) -> (Vec3, Mat3) {
    if curvature.abs() < 1e-9 {
        return (*p, Mat3::identity());
    }
    let (i, k) = (along.index(), towards.index());
    let radius = 1.0 / curvature;
    let side = radius.signum();
    let (x, y) = (p[i] * side, (radius - p[k]) * side);
    let length = x.hypot(y).max(1e-9);
    let (sin, cos) = (x / length, y / length);
    let stretch = radius.abs() / length;
    let mut straight = *p;
    straight[i] = x.atan2(y) * radius;
    straight[k] = radius - side * length;
    let mut jacobian = Mat3::identity();
    // d(angle) = (cos dx − sin dy) / length and d(length) = sin dx + cos dy, with dx = side dp_i, dy = −side dp_k.
    (jacobian[(i, i)], jacobian[(i, k)]) = (stretch * cos, stretch * sin);
    (jacobian[(k, i)], jacobian[(k, k)]) = (-sin, cos);
    (straight, jacobian)
}
