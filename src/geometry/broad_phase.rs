//! Which of many boxes overlap.

use parry3d_f64::{
    bounding_volume,
    partitioning::{Bvh, BvhBuildStrategy},
};

use super::{Aabb, mesh::to_parry};

/// The box of something that may touch others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Its box, in a frame common to all.
    pub bounds: Aabb,
    /// Things of one group never touch each other (the links of one robot, the walls of one basket).
    pub group: u32,
}

/// Index pairs (i < j) of candidates of different groups whose boxes overlap or touch, in ascending order.
pub fn candidate_pairs(candidates: &[Candidate]) -> Vec<(usize, usize)> {
    let boxes: Vec<bounding_volume::Aabb> = candidates
        .iter()
        .map(|c| bounding_volume::Aabb::new(to_parry(&c.bounds.min), to_parry(&c.bounds.max)))
        .collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    let mut pairs = Vec::new();
    for (i, bounds) in boxes.iter().enumerate() {
        let overlapping = tree.intersect_aabb(bounds).map(|j| j as usize);
        pairs.extend(
            overlapping.filter(|&j| i < j && candidates[i].group != candidates[j].group).map(|j| (i, j)),
        );
    }
    pairs.sort_unstable();
    pairs
}
