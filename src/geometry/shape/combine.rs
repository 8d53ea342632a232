//! Boolean and smooth combinations of two signed distances at the same point.
//!
//! A plain maximum of two distances is too small outside of the edge where the surfaces meet (by up to 30 % at a right
//! angle). Treating the surfaces as planes gives the distance to their common edge where the edge is nearest. This is
//! exact for planes and accurate to first order otherwise; [`intersect_exactly`] iterates it.

use crate::Vec3;

/// Signed distance (m) of a shape at a point, and the outward unit normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SignedDistance {
    pub distance: f64,
    pub normal: Vec3,
}

impl SignedDistance {
    /// The empty shape, infinitely far away.
    pub(super) const EMPTY: Self = Self::new(f64::INFINITY, Vec3::new(0.0, 0.0, 1.0));

    pub(super) const fn new(distance: f64, normal: Vec3) -> Self {
        Self { distance, normal }
    }

    /// Divides a value by the length of its gradient. Half-way between facing surfaces the gradient vanishes; the bound
    /// keeps the distance finite there, where no surface is near.
    pub(super) fn from_gradient(value: f64, gradient: Vec3) -> Self {
        let length = gradient.norm();
        if length < 1e-9 {
            return Self::new(value, Vec3::z());
        }
        Self::new(value / length.max(0.2), gradient / length)
    }

    pub(super) fn inverted(self) -> Self {
        Self::new(-self.distance, -self.normal)
    }

    /// The intersection of two shapes.
    pub(super) fn intersect(self, other: Self) -> Self {
        let (a, b) = (self, other);
        let cosine = a.normal.dot(&b.normal);
        let (reach_a, reach_b) = (a.distance - cosine * b.distance, b.distance - cosine * a.distance);
        let square = 1.0 - cosine * cosine;
        // The edge is nearest only if both planes must be reached for it.
        if reach_a > 0.0 && reach_b > 0.0 && a.distance.max(b.distance) > 0.0 && square > 1e-6 {
            let arm = (a.normal * reach_a + b.normal * reach_b) / square;
            let length = arm.norm();
            return Self::new(length, arm / length);
        }
        if a.distance >= b.distance { a } else { b }
    }

    /// The union of two shapes.
    pub(super) fn unite(self, other: Self) -> Self {
        self.inverted().intersect(other.inverted()).inverted()
    }

    /// The union with a filled seam: the quadratic polynomial smooth minimum (Quilez, "smooth minimum", 2013).
    pub(super) fn unite_smoothly(self, other: Self, blend: f64) -> Self {
        let (a, b) = (self, other);
        let share = (0.5 + 0.5 * (b.distance - a.distance) / blend).clamp(0.0, 1.0);
        // The derivative of the value by the share vanishes here, so the gradient is the mixture of the normals.
        Self::from_gradient(
            b.distance + (a.distance - b.distance) * share - blend * share * (1.0 - share),
            b.normal + (a.normal - b.normal) * share,
        )
    }
}

/// Rounds of linearisation in [`intersect_exactly`].
const ROUNDS: usize = 4;
/// Sweeps over the planes per round.
const SWEEPS: usize = 24;
/// Points up to this far outside of a part count as inside, m.
const TOLERANCE: f64 = 2e-5;

/// The intersection of `parts` shapes, whose distances at a point `field` gives: finds the nearest point of
/// the intersection by sequential quadratic programming, each round with Hildreth's (1957) coordinate ascent
/// over the tangent planes.
pub(super) fn intersect_exactly(
    parts: usize,
    p: &Vec3,
    field: &dyn Fn(usize, &Vec3) -> SignedDistance,
) -> SignedDistance {
    let farthest =
        (0..parts).map(|part| field(part, p)).reduce(|a, b| if b.distance > a.distance { b } else { a });
    let Some(farthest) = farthest else { return SignedDistance::EMPTY };
    if farthest.distance <= 0.0 {
        return farthest;
    }
    let violation = |q: &Vec3| (0..parts).map(|part| field(part, q).distance).fold(0.0, f64::max);
    let mut best: Option<Candidate> = None;
    // A cut through the shape is found from the surface that it cuts, not from afar, so every part is a start.
    for start in 0..parts {
        let SignedDistance { distance, normal } = field(start, p);
        if distance <= 0.0 {
            continue;
        }
        let foot = p - normal * distance;
        // No point is nearer than the nearest point of the farthest part, if the other parts contain it.
        if distance >= farthest.distance && violation(&foot) <= TOLERANCE {
            return farthest;
        }
        let q = descend(parts, p, foot, field);
        let candidate = Candidate { violation: violation(&q).max(TOLERANCE), length: (p - q).norm(), q };
        if best.as_ref().is_none_or(|best| candidate.is_better_than(best)) {
            best = Some(candidate);
        }
    }
    match best {
        Some(Candidate { length, q, .. }) if length > 1e-9 => SignedDistance::new(length, (p - q) / length),
        _ => farthest,
    }
}

/// A candidate for the nearest point.
struct Candidate {
    /// Distance to the part that contains it least, m.
    violation: f64,
    /// Distance to the query point, m.
    length: f64,
    q: Vec3,
}

impl Candidate {
    fn is_better_than(&self, other: &Self) -> bool {
        (self.violation, self.length) < (other.violation, other.length)
    }
}

/// A half-space `normal · x ≤ offset` and the multiplier of its constraint.
#[derive(Clone)]
struct HalfSpace {
    offset: f64,
    normal: Vec3,
    multiplier: f64,
}

/// Repeatedly projects `p` on the intersection of the tangent half-spaces of all parts, linearised first at `q`.
fn descend(parts: usize, p: &Vec3, mut q: Vec3, field: &dyn Fn(usize, &Vec3) -> SignedDistance) -> Vec3 {
    let mut planes = vec![HalfSpace { offset: 0.0, normal: Vec3::zeros(), multiplier: 0.0 }; parts];
    for _ in 0..ROUNDS {
        for (part, plane) in planes.iter_mut().enumerate() {
            let SignedDistance { distance, normal } = field(part, &q);
            *plane = HalfSpace { offset: normal.dot(&q) - distance, normal, multiplier: 0.0 };
        }
        q = project(&mut planes, p);
    }
    q
}

/// The point of the intersection of half-spaces nearest to `p`.
fn project(planes: &mut [HalfSpace], p: &Vec3) -> Vec3 {
    let mut q = *p;
    for _ in 0..SWEEPS {
        for plane in planes.iter_mut() {
            let next = (plane.multiplier + plane.normal.dot(&q) - plane.offset).max(0.0);
            q -= plane.normal * (next - plane.multiplier);
            plane.multiplier = next;
        }
    }
    q
}
