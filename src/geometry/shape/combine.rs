//! Combining two signed distances with unit normals at the same point.
//!
//! A plain maximum of two distances is too small outside of the edge where the surfaces meet (up to 30 % at a right
//! angle). Taking the surfaces as planes gives the distance to their common edge where that is nearest, which is exact
//! for planes and right to first order for the rest; [`intersect_exactly`] repeats this where it arrives.

use crate::geometry::Vec3;

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

/// Rounds of [`descend`].
const ROUNDS: usize = 4;
/// Sweeps over the planes in a round.
const SWEEPS: usize = 24;

/// What lies in all of the parts, whose fields at a point `field` gives: the nearest point of the intersection by
/// sequential quadratic programming, each round with Hildreth's (1957) coordinate ascent over the tangent planes.
pub(super) fn intersect_exactly(parts: usize, p: &Vec3, field: &dyn Fn(usize, &Vec3) -> Field) -> Field {
    let Some(most) = (0..parts).map(|part| field(part, p)).reduce(|a, b| if b.0 > a.0 { b } else { a })
    else {
        return NOWHERE;
    };
    if most.0 <= 0.0 {
        return most;
    }
    let violation = |q: &Vec3| (0..parts).map(|part| field(part, q).0).fold(0.0, f64::max);
    let mut best: Option<(f64, f64, Vec3)> = None;
    // A cut that goes right through is met from the surface that it cuts, not from afar, so every part is tried first.
    for start in 0..parts {
        let (distance, normal) = field(start, p);
        if distance <= 0.0 {
            continue;
        }
        let foot = p - normal * distance;
        // Nothing is nearer than the nearest point of the farthest part, if the others contain it.
        if distance >= most.0 && violation(&foot) <= TOLERANCE {
            return most;
        }
        let q = descend(parts, p, foot, field);
        let candidate = (violation(&q).max(TOLERANCE), (p - q).norm(), q);
        if best.is_none_or(|(off, length, _)| (candidate.0, candidate.1) < (off, length)) {
            best = Some(candidate);
        }
    }
    match best {
        Some((_, length, q)) if length > 1e-9 => (length, (p - q) / length),
        _ => most,
    }
}

/// Points this far outside of a part still count as in it, m.
const TOLERANCE: f64 = 2e-5;

/// Rounds of nearest points behind the tangent planes of all parts, from `q` on.
fn descend(parts: usize, p: &Vec3, mut q: Vec3, field: &dyn Fn(usize, &Vec3) -> Field) -> Vec3 {
    let mut planes = vec![(0.0, Vec3::zeros(), 0.0); parts];
    for _ in 0..ROUNDS {
        for (part, plane) in planes.iter_mut().enumerate() {
            let (distance, normal) = field(part, &q);
            *plane = (normal.dot(&q) - distance, normal, 0.0);
        }
        q = nearest_behind(&mut planes, p);
    }
    q
}

/// The point nearest to `p` behind all planes (offset, unit normal, multiplier).
fn nearest_behind(planes: &mut [(f64, Vec3, f64)], p: &Vec3) -> Vec3 {
    let mut q = *p;
    for _ in 0..SWEEPS {
        for (offset, normal, pull) in planes.iter_mut() {
            let next = (*pull + normal.dot(&q) - *offset).max(0.0);
            q -= *normal * (next - *pull);
            *pull = next;
        }
    }
    q
}

/// The field of nothing.
pub(super) const NOWHERE: Field = (f64::INFINITY, Vec3::new(0.0, 0.0, 1.0));

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
