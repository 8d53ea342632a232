//! Search for the samples of a soft body near a collider.

use super::collider::Collider;
use crate::fem::FemState;
use softvt_geometry::{Aabb, Mat3, Pose, Vec3, shape::SampleContact};

/// A sample near a surface, at the start of the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactCandidate {
    /// Sample group of the body.
    pub(crate) group: usize,
    /// Sample of the body.
    pub(crate) sample: usize,
    /// Position of the sample, m, world.
    pub(crate) p: Vec3,
    /// Gap, m; negative is overlap.
    pub(crate) gap: f64,
    /// Outward unit normal of the surface, world.
    pub(crate) normal: Vec3,
    /// Covered share of the sample's area, 0..=1.
    pub(crate) coverage: f64,
}

/// Pose and velocity of a collider at the start of the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColliderMotion {
    /// Collider frame in the world.
    pub(crate) pose: Pose,
    /// Velocity of the parent's origin, m/s, world.
    pub(crate) linear: Vec3,
    /// Angular velocity, rad/s, world.
    pub(crate) angular: Vec3,
    /// The parent's origin, m, world; of a rigid body its centre of mass.
    pub(crate) origin: Vec3,
}

impl ColliderMotion {
    /// Velocity of the parent's material point at `p` (m, world), m/s.
    pub(crate) fn velocity(&self, p: &Vec3) -> Vec3 {
        self.linear + self.angular.cross(&(p - self.origin))
    }
}

/// Distances and times that limit a search for contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DetectionLimits {
    /// Time step, s.
    pub(crate) dt: f64,
    /// Samples closer than this become contact points, m.
    pub(crate) margin: f64,
    /// Nodes of samples closer than this are retained in the reduced system, m.
    pub(crate) reach: f64,
}

impl DetectionLimits {
    /// Steps of approach within which a contact point is created (speculative contact).
    pub(crate) const STEPS_AHEAD: f64 = 1.5;

    /// Approach within [`Self::STEPS_AHEAD`] steps at a speed (m/s), m.
    pub(crate) fn approach_distance(&self, speed: f64) -> f64 {
        Self::STEPS_AHEAD * self.dt * speed
    }
}

/// Bounds of a body and its sample groups at the start of a step, shared by the searches against all colliders.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyBounds {
    body: Option<Aabb>,
    groups: Vec<Aabb>,
    max_speed: f64,
    /// Edge of the largest patch of its samples, m.
    max_spacing: f64,
}

impl BodyBounds {
    /// Computes the bounds of `body`.
    pub(crate) fn update(&mut self, body: &FemState) {
        self.body = Aabb::from_points(&body.x);
        self.max_speed = body.max_speed();
        self.max_spacing = body.model.max_spacing();
        self.groups.clear();
        self.groups.extend(body.model.groups.iter().map(|group| {
            let first = body.x[group.nodes[0] as usize];
            let nodes = group.nodes[1..group.count].iter().map(|&node| &body.x[node as usize]);
            nodes.fold(Aabb { min: first, max: first }, |Aabb { min, max }, x| Aabb {
                min: min.inf(x),
                max: max.sup(x),
            })
        }));
    }
}

/// Collects the candidates of `body` against `collider` into `out`, in sample order.
///
/// Calls `near` with every sample group within [`DetectionLimits::reach`], so that its nodes are retained
/// before the contact begins.
pub(crate) fn detect(
    body: &FemState,
    body_bounds: &BodyBounds,
    collider: &Collider,
    motion: &ColliderMotion,
    limits: DetectionLimits,
    out: &mut Vec<ContactCandidate>,
    near: &mut dyn FnMut(usize),
) {
    let DetectionLimits { margin, reach, .. } = limits;
    let bounds = collider.bounds;
    let around = body_bounds.body.unwrap_or(bounds);
    let lever = (around.centre() - motion.origin).norm() + around.size().norm();
    let speed = body_bounds.max_speed + motion.linear.norm() + motion.angular.norm() * lever;
    // No sample contacts the collider from farther away: one may cover a face from half a spacing beyond its edge.
    let search_distance =
        margin.max(reach).max(limits.approach_distance(speed)) + 0.5 * body_bounds.max_spacing;
    let near_collider = bounds.transformed(&motion.pose).loosened(search_distance);
    if !around.intersects(&near_collider) {
        return;
    }
    let (frame, near_in_frame) = (ColliderFrame::new(motion), bounds.loosened(search_distance));
    for (index, (group, around)) in body.model.groups.iter().zip(&body_bounds.groups).enumerate() {
        if !around.intersects(&near_collider) {
            continue;
        }
        let mut nodes = LocalNodeGroup::new(body, &group.nodes[..group.count], &frame);
        if !nodes.bounds.intersects(&near_in_frame) {
            continue;
        }
        nodes.set_velocities(body, &group.nodes[..group.count], motion);
        let farthest = margin.max(reach).max(limits.approach_distance(nodes.max_speed()));
        let near_surface = bounds.loosened(farthest + 0.5 * group.spacing);
        if !nodes.bounds.intersects(&near_surface) {
            continue;
        }
        // A patch contacts a face from half its edge beyond that of the face.
        let (centre, radius) = (nodes.bounds.centre(), 0.5 * nodes.bounds.size().norm());
        if collider.surface.is_farther(&centre, farthest + group.spacing + radius) {
            continue;
        }
        let (mut is_near, mut clear) = (false, ClearBall::default());
        for sample in group.first..group.last {
            let data = &body.model.samples[sample];
            let local = weighted_mean(nodes.count, &nodes.x, &data.weights);
            if !near_surface.contains(&local) || clear.contains(&local) {
                continue;
            }
            let facing = body.rotation[data.surface.at.element as usize] * data.surface.n_o;
            let local_facing = frame.to_world.tr_mul(&facing);
            let spacing = data.surface.area.sqrt();
            let SampleContact { gap, normal, coverage } =
                collider.surface.contact(&local, &local_facing, spacing);
            if gap > farthest {
                clear = ClearBall::new(local, gap, farthest + group.spacing);
                continue;
            }
            // Normals that agree mean that the surface is behind the sample: the far side of a thin body.
            if coverage <= 0.0 || local_facing.dot(&normal) > 0.3 {
                continue;
            }
            is_near |= gap < reach;
            let normal = frame.to_world * normal;
            if gap < margin || gap < limits.approach_distance(nodes.approach_speed(&data.weights, &normal)) {
                let p = frame.to_world * local + frame.origin;
                out.push(ContactCandidate { group: index, sample, p, gap, normal, coverage });
            }
        }
        if is_near {
            near(index);
        }
    }
}

/// A collider's frame in the world, as a matrix.
struct ColliderFrame {
    to_world: Mat3,
    origin: Vec3,
}

impl ColliderFrame {
    fn new(motion: &ColliderMotion) -> Self {
        Self {
            to_world: *motion.pose.rotation.to_rotation_matrix().matrix(),
            origin: motion.pose.translation.vector,
        }
    }
}

/// A ball in a collider's frame in which no sample contacts the collider.
#[derive(Default)]
struct ClearBall {
    centre: Vec3,
    radius2: f64,
}

impl ClearBall {
    /// Share of a distance that is certain: those of composite shapes may be slightly too large.
    const CERTAIN: f64 = 0.8;
    /// Largest distance that is relied on, m; those of composite shapes are less accurate farther away.
    const MAX_DISTANCE: f64 = 5e-3;

    /// The ball around a sample at `centre` with this gap, in which all others are farther than `reach`, m.
    fn new(centre: Vec3, gap: f64, reach: f64) -> Self {
        let radius = (Self::CERTAIN * gap.min(Self::MAX_DISTANCE) - reach).max(0.0);
        Self { centre, radius2: radius * radius }
    }

    fn contains(&self, p: &Vec3) -> bool {
        (p - self.centre).norm_squared() < self.radius2
    }
}

/// Positions of a group's nodes in a collider's frame, and their velocities against the collider.
struct LocalNodeGroup {
    count: usize,
    x: [Vec3; 8],
    v: [Vec3; 8],
    bounds: Aabb,
}

impl LocalNodeGroup {
    /// The group with its velocities left at zero.
    fn new(body: &FemState, nodes: &[u32], frame: &ColliderFrame) -> Self {
        let mut local = Self {
            count: nodes.len(),
            x: [Vec3::zeros(); 8],
            v: [Vec3::zeros(); 8],
            bounds: Aabb { min: Vec3::repeat(f64::INFINITY), max: Vec3::repeat(f64::NEG_INFINITY) },
        };
        for (i, &node) in nodes.iter().enumerate() {
            local.x[i] = frame.to_world.tr_mul(&(body.x[node as usize] - frame.origin));
            local.bounds.min = local.bounds.min.inf(&local.x[i]);
            local.bounds.max = local.bounds.max.sup(&local.x[i]);
        }
        local
    }

    /// Sets the velocities. Most groups turn out to be too far away without them.
    fn set_velocities(&mut self, body: &FemState, nodes: &[u32], motion: &ColliderMotion) {
        for (v, &node) in self.v.iter_mut().zip(nodes) {
            *v = body.v[node as usize] - motion.velocity(&body.x[node as usize]);
        }
    }

    /// Speed of the fastest node against the collider, m/s.
    fn max_speed(&self) -> f64 {
        self.v.iter().map(Vec3::norm_squared).fold(0.0, f64::max).sqrt()
    }

    /// Speed of a sample towards a surface of unit normal `normal` (world) of the collider, m/s.
    fn approach_speed(&self, weights: &[f64; 8], normal: &Vec3) -> f64 {
        -weighted_mean(self.count, &self.v, weights).dot(normal)
    }
}

/// Weighted mean over `count` nodes. The four nodes of a face are the common case, for which the sum is unrolled.
#[inline(always)]
fn weighted_mean(count: usize, values: &[Vec3; 8], weights: &[f64; 8]) -> Vec3 {
    let over = |n: usize| (1..n).fold(values[0] * weights[0], |sum, i| sum + values[i] * weights[i]);
    if count <= 4 { over(4) } else { over(8) }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, LazyLock};

    use proptest::prelude::*;

    use super::*;
    use crate::{
        BodyId,
        contact::{Friction, SurfaceStiffness},
        fem::{ElasticMaterial, FemModel},
    };
    use softvt_geometry::{Pose, Quat, samples::SampleSpec, shape::Shape};

    const LIMITS: DetectionLimits = DetectionLimits { dt: 1.0 / 60.0, margin: 2e-4, reach: 2e-4 };

    static BODY: LazyLock<FemState> = LazyLock::new(|| {
        let material = ElasticMaterial::new(3e4, 0.3, 200.0).expect("valid");
        let shape = Shape::cuboid(Vec3::new(0.04, 0.03, 0.05)).rounded(4e-3);
        let model = FemModel::from_shape(&shape, 6e-5, material, 8, &SampleSpec::default()).unwrap();
        FemState::new(model, &Pose::identity())
    });

    /// Surfaces with edges, of one piece and of several, with exact distances and approximate ones.
    fn surfaces() -> [Shape; 5] {
        let block = Shape::cuboid(Vec3::new(0.022, 0.022, 0.01));
        [
            block.clone(),
            Shape::Cylinder { radius: 0.03, half_height: 0.01 },
            Shape::Ellipsoid { radii: Vec3::new(0.03, 0.02, 0.01) },
            Shape::cuboid(Vec3::new(0.08, 0.08, 0.05)).subtract(Shape::Sphere { radius: 0.035 }),
            Shape::Union(vec![block.clone(), block.translated(Vec3::new(0.015, 0.004, 0.003))]),
        ]
    }

    /// The samples that [`detect`] should find with their gaps, by a test of every sample.
    fn by_all_samples(body: &FemState, collider: &Collider, motion: &ColliderMotion) -> Vec<(usize, f64)> {
        let mut found = Vec::new();
        for group in &body.model.groups {
            let nodes = &group.nodes[..group.count];
            let mean = |values: &[Vec3], weights: &[f64; 8]| -> Vec3 {
                nodes.iter().zip(weights).map(|(&node, w)| values[node as usize] * *w).sum()
            };
            for sample in group.first..group.last {
                let data = &body.model.samples[sample];
                let (p, v) = (mean(&body.x, &data.weights), mean(&body.v, &data.weights));
                let facing = body.rotation[data.surface.at.element as usize] * data.surface.n_o;
                let [local, facing] = [p - motion.pose.translation.vector, facing]
                    .map(|vector| motion.pose.rotation.inverse() * vector);
                let contact = collider.surface.contact(&local, &facing, data.surface.area.sqrt());
                let approach = -(motion.pose.rotation * contact.normal).dot(&(v - motion.velocity(&p)));
                let limit = LIMITS.margin.max(LIMITS.approach_distance(approach));
                if contact.gap < limit && contact.coverage > 0.0 && facing.dot(&contact.normal) <= 0.3 {
                    found.push((sample, contact.gap));
                }
            }
        }
        found
    }

    proptest! {
        #[test]
        fn every_sample_in_contact_is_found_and_of_the_others_only_those_that_approach(
            surface in 0_usize..5,
            direction in prop::array::uniform3(-1.0..1.0),
            turn in prop::array::uniform3(-3.0..3.0),
            // Of the collider's origin from the body's centre, m.
            distance in 0.015..0.05,
            // Without any, only samples that touch or cover an edge are found.
            speed in prop::sample::select(vec![0.0, 0.02, 0.3]),
            linear in prop::array::uniform3(-1.0..1.0),
            angular in prop::array::uniform3(-7.0..7.0),
        ) {
            let origin: Vec3 = Vec3::from(direction).try_normalize(1e-3).unwrap_or(Vec3::z()) * distance;
            let pose = Pose::from_parts(origin.into(), Quat::from_scaled_axis(Vec3::from(turn)));
            let motion =
                ColliderMotion { pose, linear: Vec3::from(linear) * speed, angular: Vec3::from(angular) * speed, origin };
            let stiffness = SurfaceStiffness { normal: 1e8, shear: 1e8 };
            let surface = Arc::new(surfaces()[surface].clone());
            let collider =
                Collider::new("surface", BodyId::World, Pose::identity(), surface, Friction::NONE, stiffness);
            let (mut bounds, mut found, mut near) = (BodyBounds::default(), Vec::new(), Vec::new());
            bounds.update(&BODY);
            detect(&BODY, &bounds, &collider, &motion, LIMITS, &mut found, &mut |group| near.push(group));
            let touching_groups = found.iter().filter(|candidate| candidate.gap < LIMITS.reach);
            prop_assert!(touching_groups.map(|candidate| candidate.group).all(|group| near.contains(&group)));
            let found: Vec<_> = found.iter().map(|candidate| candidate.sample).collect();
            let expected = by_all_samples(&BODY, &collider, &motion);
            // Distances are approximate far from a surface, and differ from the gap where two faces meet.
            let touching = expected.iter().filter(|(_, gap)| gap.abs() < LIMITS.margin);
            let missed: Vec<_> = touching.filter(|(sample, _)| !found.contains(sample)).collect();
            prop_assert!(missed.is_empty(), "missed {missed:?}");
            let is_known = |sample: &usize| expected.iter().any(|(other, _)| other == sample);
            let extra: Vec<_> = found.iter().filter(|sample| !is_known(sample)).collect();
            prop_assert!(extra.is_empty(), "extra {extra:?}");
        }
    }
}
