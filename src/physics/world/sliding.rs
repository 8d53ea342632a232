//! Which pairs of surfaces slide as a whole.
//!
//! The samples of a patch share a load by their stiffness, not by their pressure, so lightly loaded ones reach the static
//! bound before the patch does. If each of them then fell to dynamic friction alone, its share would overload the next, and
//! a block would let go far below μ_s N. So dynamic friction begins for a pair when (nearly) all of its force is at the
//! bound, which is when the surfaces slide on each other, and ends when a step leaves part of it inside.

use super::RowOf;
use crate::physics::solver::Point;

/// Share of a pair's normal force that is at the friction bound when the pair slides.
const SLIDING_SHARE: f64 = 0.97;

/// Normal impulse of pairs, N s: what there is, and what is at the friction bound.
#[derive(Debug, Default)]
pub(super) struct Sliding<K>(Vec<(K, f64, f64)>);

impl<K: PartialEq + Copy> Sliding<K> {
    /// Sums up the points of each pair.
    pub(super) fn of<'a>(points: impl Iterator<Item = (K, &'a Point)>) -> Self {
        let mut sums: Vec<(K, f64, f64)> = Vec::new();
        for (key, point) in points {
            // Points of a pair come in runs, so the last entry is nearly always it.
            let at = sums.iter().rposition(|(known, ..)| *known == key).unwrap_or_else(|| {
                sums.push((key, 0.0, 0.0));
                sums.len() - 1
            });
            sums[at].1 += point.normal_impulse;
            sums[at].2 += if point.slipping { point.normal_impulse } else { 0.0 };
        }
        Self(sums)
    }

    /// Whether a pair slides as a whole.
    pub(super) fn slides(&self, key: K) -> bool {
        self.0.iter().any(|(known, all, slipping)| *known == key && *slipping >= SLIDING_SHARE * all)
    }
}

impl RowOf {
    /// The pair of surfaces that a row is between.
    pub(super) fn pair(&self) -> (usize, u32) {
        (self.soft, self.partner)
    }
}
