//! Axis-aligned bounding boxes.

use parry3d_f64::{
    bounding_volume,
    partitioning::{Bvh, BvhBuildStrategy},
};
use serde::{Deserialize, Serialize};

use super::{Pose, Vec3, parry::to_parry};

/// An axis-aligned box, in whatever frame its corners are given in. Closed: its faces belong to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Aabb {
    /// Lowest corner, m.
    pub min: Vec3,
    /// Highest corner, m.
    pub max: Vec3,
}

impl Aabb {
    /// The smallest box that contains all `points`; `None` if there are no points.
    pub fn from_points<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> Option<Self> {
        points.into_iter().fold(None, |sofar, p| {
            let Self { min, max } = sofar.unwrap_or(Self { min: *p, max: *p });
            Some(Self { min: min.inf(p), max: max.sup(p) })
        })
    }

    /// The box about the origin with these half extents, m.
    pub fn from_half_extents(half: Vec3) -> Self {
        Self { min: -half, max: half }
    }

    /// Edge lengths, m.
    #[inline]
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// Midpoint between the corners, m.
    #[inline]
    pub fn centre(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// The box enlarged by `margin` (m) on every side.
    #[inline]
    pub fn loosened(&self, margin: f64) -> Self {
        Self { min: self.min.add_scalar(-margin), max: self.max.add_scalar(margin) }
    }

    /// The smallest box that contains both.
    pub fn merged(&self, other: &Self) -> Self {
        Self { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// The smallest axis-aligned box around this one after a rigid motion.
    pub fn transformed(&self, pose: &Pose) -> Self {
        let centre = pose.rotation * self.centre() + pose.translation.vector;
        let half = pose.rotation.to_rotation_matrix().into_inner().abs() * (0.5 * self.size());
        Self { min: centre - half, max: centre + half }
    }

    /// True if the boxes overlap or touch.
    #[inline]
    pub fn intersects(&self, other: &Self) -> bool {
        (0..3).all(|i| self.min[i] <= other.max[i] && other.min[i] <= self.max[i])
    }

    /// True if the point lies inside or on a face.
    #[inline]
    pub fn contains(&self, p: &Vec3) -> bool {
        (0..3).all(|i| self.min[i] <= p[i] && p[i] <= self.max[i])
    }

    /// Distance between two boxes, m; 0 if they intersect.
    pub fn distance(&self, other: &Self) -> f64 {
        let gap = |i: usize| (other.min[i] - self.max[i]).max(self.min[i] - other.max[i]).max(0.0);
        Vec3::new(gap(0), gap(1), gap(2)).norm()
    }
}

/// A bounding box for the broad phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupedAabb {
    /// Bounds, in a frame common to all boxes.
    pub bounds: Aabb,
    /// Boxes of the same group never form a pair (the links of one robot, the walls of one basket).
    pub group: u32,
}

/// Index pairs (i < j) of intersecting boxes of different groups, in ascending order.
pub fn overlapping_pairs(grouped: &[GroupedAabb]) -> Vec<(usize, usize)> {
    let boxes: Vec<bounding_volume::Aabb> = grouped
        .iter()
        .map(|c| bounding_volume::Aabb::new(to_parry(&c.bounds.min), to_parry(&c.bounds.max)))
        .collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    let mut pairs = Vec::new();
    for (i, bounds) in boxes.iter().enumerate() {
        let overlapping = tree.intersect_aabb(bounds).map(|j| j as usize);
        pairs.extend(overlapping.filter(|&j| i < j && grouped[i].group != grouped[j].group).map(|j| (i, j)));
    }
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn boxes_that_share_a_face_intersect_and_have_no_distance() {
        let cube = |x: f64| Aabb { min: Vec3::new(x, 0.0, 0.0), max: Vec3::new(x + 1.0, 1.0, 1.0) };
        assert!(cube(0.0).intersects(&cube(1.0)) && cube(0.0).distance(&cube(1.0)) == 0.0);
        assert!(!cube(0.0).intersects(&cube(1.5)) && cube(0.0).distance(&cube(1.5)) == 0.5);
        assert!(cube(0.0).loosened(0.5).intersects(&cube(1.5)));
        assert!(cube(0.0).contains(&Vec3::repeat(1.0)) && !cube(0.0).contains(&Vec3::repeat(1.1)));
    }

    #[test]
    fn overlapping_pairs_match_brute_force() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for count in [0, 1, 2, 3, 40] {
            let boxes: Vec<GroupedAabb> = (0..count)
                .map(|_| {
                    let min = Vec3::from_fn(|_, _| rng.random_range(0.0..1.0));
                    let size = Vec3::from_fn(|_, _| rng.random_range(0.0..0.3));
                    GroupedAabb { bounds: Aabb { min, max: min + size }, group: rng.random_range(0..5) }
                })
                .collect();
            let mut expected = Vec::new();
            for (j, b) in boxes.iter().enumerate() {
                for (i, a) in boxes[..j].iter().enumerate() {
                    if a.group != b.group && a.bounds.intersects(&b.bounds) {
                        expected.push((i, j));
                    }
                }
            }
            expected.sort_unstable();
            assert_eq!(overlapping_pairs(&boxes), expected);
        }
    }
}
