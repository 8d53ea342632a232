//! Combining two signed distances with unit normals at the same point.
//!
//! A plain maximum of two distances is too small outside of the edge where the surfaces meet (up to 30 % at a right
//! angle). Taking both surfaces as planes gives the distance to their common edge where that is nearest, which is exact
//! for planes and right to first order for the rest.

use super::Vec3;

/// A signed distance and a unit normal.
pub(super) type Field = (f64, Vec3);

/// What lies in both.
pub(super) fn intersect(a: Field, b: Field) -> Field {
    let cosine = a.1.dot(&b.1);
    let (reach_a, reach_b) = (a.0 - cosine * b.0, b.0 - cosine * a.0);
    let square = 1.0 - cosine * cosine;
    // The edge is nearest only if both planes must be reached for it.
    if reach_a > 0.0 && reach_b > 0.0 && a.0.max(b.0) > 0.0 && square > 1e-6 {
        let arm = (a.1 * reach_a + b.1 * reach_b) / square;
        let length = arm.norm();
        return (length, arm / length);
    }
    if a.0 >= b.0 { a } else { b }
}

/// The complement.
pub(super) fn invert(a: Field) -> Field {
    (-a.0, -a.1)
}

/// What lies in any.
pub(super) fn unite(a: Field, b: Field) -> Field {
    invert(intersect(invert(a), invert(b)))
}

/// What lies in any, with the seam filled: the quadratic polynomial smooth minimum (Quilez, "smooth minimum", 2013).
pub(super) fn unite_smoothly(a: Field, b: Field, blend: f64) -> Field {
    let share = (0.5 + 0.5 * (b.0 - a.0) / blend).clamp(0.0, 1.0);
    // At this share the derivative of the value to the share vanishes, so the gradient is the plain mixture.
    to_first_order(b.0 + (a.0 - b.0) * share - blend * share * (1.0 - share), b.1 + (a.1 - b.1) * share)
}

/// Divides a value by the length of its gradient. Half-way between facing surfaces the gradient vanishes; the bound
/// keeps the distance finite there, where no surface is near.
pub(super) fn to_first_order(value: f64, gradient: Vec3) -> Field {
    let length = gradient.norm();
    if length < 1e-9 {
        return (value, Vec3::z());
    }
    (value / length.max(0.2), gradient / length)
}
