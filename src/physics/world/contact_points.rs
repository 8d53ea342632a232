//! Conversion of a contact between two surfaces, of whatever bodies, to a contact point of the solver, and the
//! evolution of its tangential spring.

use crate::{
    contact::{Friction, SurfaceStiffness},
    solver::ContactPoint,
};
use softvt_geometry::Vec3;

/// Geometry and history of one contact between two surfaces.
pub(super) struct SurfaceContact {
    /// Position, m, world.
    pub p: Vec3,
    /// Unit normal, world.
    pub normal: Vec3,
    /// Gap, m; negative is overlap.
    pub gap: f64,
    /// Area that the point represents, m².
    pub area: f64,
    /// Stretch of the tangential spring, m, world; its part along the normal is ignored.
    pub stretch: Vec3,
    /// Normal impulse of the last step if it had been as long as this one, N s.
    pub previous_normal_impulse: f64,
    /// True if the two surfaces slide on each other.
    pub is_sliding: bool,
}

impl SurfaceContact {
    /// The solver's point for this contact, without node weights and drift velocity.
    pub(super) fn contact_point(&self, friction: &Friction, stiffness: &SurfaceStiffness) -> ContactPoint {
        ContactPoint {
            p: self.p,
            normal: self.normal,
            stiffness: stiffness.normal * self.area,
            shear_stiffness: stiffness.shear * self.area,
            gap: self.gap,
            offset: self.stretch - self.normal * self.normal.dot(&self.stretch),
            mu: if self.is_sliding { friction.dynamic_mu } else { friction.static_mu },
            previous_normal_impulse: self.previous_normal_impulse,
            ..ContactPoint::default()
        }
    }
}

/// Tangential spring of a solved point at the end of the step.
pub(super) struct SpringUpdate {
    /// Stretch if nothing had slipped, m, world.
    pub stretch: Vec3,
    /// Part of its length beyond what friction holds, which was slipped, m.
    pub slipped: f64,
}

impl SpringUpdate {
    pub(super) fn new(point: &ContactPoint, dt: f64) -> Self {
        let tangential = point.velocity - point.normal * point.normal.dot(&point.velocity);
        let stretch = point.offset + tangential * dt;
        if !point.is_slipping {
            return Self { stretch, slipped: 0.0 };
        }
        let allowed =
            point.mu * point.previous_normal_impulse / (dt * point.shear_stiffness).max(f64::MIN_POSITIVE);
        Self { stretch, slipped: (stretch.norm() - allowed).max(0.0) }
    }
}

/// Share of a pair's normal force that is at the friction bound while the pair slides.
const SLIDING_SHARE: f64 = 0.97;

/// Pairs of surfaces that slide as a whole.
///
/// The points of a patch share a load by their stiffness, not by their pressure, so lightly loaded ones reach the
/// static bound before the patch does. If each of them then dropped to dynamic friction alone, its share would
/// overload the next, and a block would start to slide far below μ_s N. So dynamic friction begins for a pair when
/// (nearly) all of its force is at the bound, that is when the surfaces slide on each other, and ends when a step
/// leaves part of it inside the bound.
#[derive(Debug, Default)]
pub(super) struct SlidingPairs<K>(Vec<PairImpulse<K>>);

/// Normal impulses of a pair, N s.
#[derive(Debug)]
struct PairImpulse<K> {
    pair: K,
    total: f64,
    /// Of the points at the friction bound.
    slipping: f64,
}

impl<K: PartialEq + Copy> SlidingPairs<K> {
    /// Sums the points of each pair.
    pub(super) fn new<'a>(points: impl Iterator<Item = (K, &'a ContactPoint)>) -> Self {
        let mut sums: Vec<PairImpulse<K>> = Vec::new();
        for (pair, point) in points {
            // Points of a pair come in runs, so the last entry is nearly always the right one.
            let at = sums.iter().rposition(|known| known.pair == pair).unwrap_or_else(|| {
                sums.push(PairImpulse { pair, total: 0.0, slipping: 0.0 });
                sums.len() - 1
            });
            sums[at].total += point.normal_impulse;
            sums[at].slipping += if point.is_slipping { point.normal_impulse } else { 0.0 };
        }
        Self(sums)
    }

    /// True if a pair slides as a whole.
    pub(super) fn contains(&self, pair: K) -> bool {
        self.0.iter().any(|known| known.pair == pair && known.slipping >= SLIDING_SHARE * known.total)
    }
}
