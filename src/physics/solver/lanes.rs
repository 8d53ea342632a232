//! Contact points of a cluster in packs of four, one lane per point.
//!
//! Operations on finite values round alike on every processor: there is no fused multiply-add, and sums over lanes have
//! a fixed order.

use wide::f64x4;

use super::{
    island::Island,
    problem::{ContactCluster, ContactPoint, ContactProblem, Endpoint},
};
use softvt_geometry::Vec3;

/// Number of points per pack.
pub(super) const LANES: usize = 4;

/// Sum of the lanes in a fixed order.
pub(super) fn sum_lanes(lanes: f64x4) -> f64 {
    let [a, b, c, d] = lanes.to_array();
    (a + b) + (c + d)
}

/// Four three-component vectors.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Vec3x4 {
    pub(super) x: f64x4,
    pub(super) y: f64x4,
    pub(super) z: f64x4,
}

impl Vec3x4 {
    #[inline(always)]
    pub(super) fn splat(v: &Vec3) -> Self {
        Self { x: f64x4::splat(v.x), y: f64x4::splat(v.y), z: f64x4::splat(v.z) }
    }

    fn from_lanes(of: impl Fn(usize) -> Vec3) -> Self {
        let [a, b, c, d] = [of(0), of(1), of(2), of(3)];
        let lanes = |axis: usize| f64x4::new([a[axis], b[axis], c[axis], d[axis]]);
        Self { x: lanes(0), y: lanes(1), z: lanes(2) }
    }

    #[inline(always)]
    pub(super) fn dot(self, o: Self) -> f64x4 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub(super) fn cross(self, o: Self) -> Self {
        Self {
            x: self.y * o.z - self.z * o.y,
            y: self.z * o.x - self.x * o.z,
            z: self.x * o.y - self.y * o.x,
        }
    }

    /// The vector in one lane.
    pub(super) fn lane(&self, lane: usize) -> Vec3 {
        let of = |lanes: f64x4| lanes.to_array()[lane];
        Vec3::new(of(self.x), of(self.y), of(self.z))
    }

    /// Sum of the vectors in a fixed order.
    pub(super) fn sum(self) -> Vec3 {
        Vec3::new(sum_lanes(self.x), sum_lanes(self.y), sum_lanes(self.z))
    }
}

impl std::ops::Add for Vec3x4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl std::ops::AddAssign for Vec3x4 {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl std::ops::Sub for Vec3x4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl std::ops::Mul<f64x4> for Vec3x4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: f64x4) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }
}

/// Up to four contact points of a cluster. Lanes without a point are never in contact.
#[derive(Clone, Debug)]
pub(super) struct PointPack {
    /// Weights of `a`'s nodes.
    pub(super) weights_a: [f64x4; 8],
    /// Weights of `b`'s nodes.
    pub(super) weights_b: [f64x4; 8],
    /// Positions, m, world.
    pub(super) p: Vec3x4,
    /// Unit normals from `b` to `a`, world.
    pub(super) normal: Vec3x4,
    /// Known part of the relative velocity, m/s, world.
    pub(super) drift: Vec3x4,
    /// Tangential offset from the stick anchor at the start of the step, m, world.
    pub(super) offset: Vec3x4,
    /// Gap at the start of the step, m.
    pub(super) gap: f64x4,
    /// Normal stiffness, N/m.
    pub(super) stiffness: f64x4,
    /// Tangential stiffness, N/m.
    pub(super) shear_stiffness: f64x4,
    /// Bound on the friction impulse, N s; infinite for bonded points.
    pub(super) friction_bound: f64x4,
    /// Depth below which the normal spring exerts no force, m: 0, or −∞ for bonded points, which also pull.
    pub(super) least_depth: f64x4,
}

impl PointPack {
    /// Packs one to four points; `nodes` are the numbers of nodes of `a` and `b` that have weights.
    pub(super) fn new(points: &[ContactPoint], nodes: [usize; 2]) -> Self {
        // A lane without a point repeats the last one without its forces.
        let point = |lane: usize| &points[lane.min(points.len() - 1)];
        let vectors = |of: fn(&ContactPoint) -> Vec3| Vec3x4::from_lanes(|lane| of(point(lane)));
        let weights = |count: usize, of: fn(&ContactPoint) -> &[f64; 8]| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|lane| of(point(lane)));
            let mut weights = [f64x4::ZERO; 8];
            let used = weights.iter_mut().enumerate().take(count);
            used.for_each(|(i, w)| *w = f64x4::new([a[i], b[i], c[i], d[i]]));
            weights
        };
        Self {
            weights_a: weights(nodes[0], |point| &point.weights_a),
            weights_b: weights(nodes[1], |point| &point.weights_b),
            p: vectors(|point| point.p),
            normal: vectors(|point| point.normal),
            drift: vectors(|point| point.drift),
            offset: vectors(|point| point.offset),
            gap: lanes(points, f64::INFINITY, |point| point.gap),
            stiffness: lanes(points, 0.0, |point| point.stiffness),
            shear_stiffness: lanes(points, 0.0, |point| point.shear_stiffness),
            friction_bound: friction_bound(points),
            least_depth: lanes(points, 0.0, |point| if point.is_bonded { f64::NEG_INFINITY } else { 0.0 }),
        }
    }

    /// Updates the friction bounds from the normal impulses of the previous pass of the same points.
    fn update_bound(&mut self, points: &[ContactPoint]) {
        self.friction_bound = friction_bound(points);
    }
}

fn friction_bound(points: &[ContactPoint]) -> f64x4 {
    let bound = |point: &ContactPoint| match point.is_bonded {
        true => f64::INFINITY,
        false => point.mu * point.previous_normal_impulse,
    };
    lanes(points, 0.0, bound)
}

/// A value per point; `empty` in lanes without one.
fn lanes(points: &[ContactPoint], empty: f64, of: impl Fn(&ContactPoint) -> f64) -> f64x4 {
    f64x4::new([0, 1, 2, 3].map(|lane| points.get(lane).map_or(empty, &of)))
}

/// The contact points of an island, packed by cluster.
#[derive(Clone, Debug, Default)]
pub(super) struct IslandPacks {
    packs: Vec<PointPack>,
    /// The end of the packs of each cluster of the island.
    ends: Vec<usize>,
}

impl IslandPacks {
    /// Packs the points of an island.
    pub(super) fn set(&mut self, problem: &ContactProblem, island: &Island) {
        self.packs.clear();
        self.ends.clear();
        for cluster in island.clusters.iter().map(|&index| &problem.clusters[index]) {
            let nodes = [&cluster.a, &cluster.b].map(Endpoint::node_count);
            let points = problem.points[cluster.first..cluster.last].chunks(LANES);
            self.packs.extend(points.map(|points| PointPack::new(points, nodes)));
            self.ends.push(self.packs.len());
        }
    }

    /// Updates the friction bounds from the normal impulses of the previous pass.
    pub(super) fn update_bounds(&mut self, problem: &ContactProblem, island: &Island) {
        let clusters = island.clusters.iter().map(|&index| &problem.clusters[index]);
        let points = clusters.flat_map(|cluster| problem.points[cluster.first..cluster.last].chunks(LANES));
        self.packs.iter_mut().zip(points).for_each(|(pack, points)| pack.update_bound(points));
    }

    /// The packs of each cluster of the island.
    pub(super) fn of_clusters(&self) -> impl Iterator<Item = &[PointPack]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.packs[start..end])
    }

    /// The clusters of the island with their packs.
    pub(super) fn clusters<'a>(
        &'a self,
        problem: &'a ContactProblem,
        island: &'a Island,
    ) -> impl Iterator<Item = (&'a ContactCluster, &'a [PointPack])> {
        island.clusters.iter().map(|&index| &problem.clusters[index]).zip(self.of_clusters())
    }
}
