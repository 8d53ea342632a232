//! Search for the samples of a soft body near a collider.

use super::collider::Collider;
use crate::fem::FemState;
use softvt_geometry::{Aabb, Mat3, Pose, Vec3};

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
    pub(super) fn approach_distance(&self, speed: f64) -> f64 {
        Self::STEPS_AHEAD * self.dt * speed
    }
}

/// Bounds of a body and its sample groups at the start of a step, shared by the searches against all colliders.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyBounds {
    body: Option<Aabb>,
    groups: Vec<Aabb>,
    max_speed: f64,
}

impl BodyBounds {
    /// Computes the bounds of `body`.
    pub(crate) fn update(&mut self, body: &FemState) {
        self.body = Aabb::from_points(&body.x);
        self.max_speed = body.max_speed();
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
    // No sample contacts the collider from farther away.
    let farthest = reach.max(limits.approach_distance(speed));
    let near_collider = bounds.transformed(&motion.pose).loosened(farthest);
    if !around.intersects(&near_collider) {
        return;
    }
    let (frame, near_in_frame) = (ColliderFrame::new(motion), bounds.loosened(farthest));
    for (index, (group, around)) in body.model.groups.iter().zip(&body_bounds.groups).enumerate() {
        if !around.intersects(&near_collider) {
            continue;
        }
        let mut nodes = LocalNodeGroup::new(body, &group.nodes[..group.count], &frame);
        if !nodes.bounds.intersects(&near_in_frame) {
            continue;
        }
        nodes.set_velocities(body, &group.nodes[..group.count], motion);
        let ahead = limits.approach_distance(nodes.max_speed());
        let near_surface = bounds.loosened(reach.max(ahead));
        if !nodes.bounds.intersects(&near_surface) {
            continue;
        }
        // A patch contacts a face from half its edge beyond that of the face.
        let (centre, radius) = (nodes.bounds.centre(), 0.5 * nodes.bounds.size().norm());
        if collider.surface.is_farther(&centre, margin.max(reach).max(ahead) + group.spacing + radius) {
            continue;
        }
        let mut is_near = false;
        for sample in group.first..group.last {
            let candidate = test_sample(body, collider, &frame, &nodes, index, sample, &near_surface);
            let Some(candidate) = candidate else { continue };
            is_near |= candidate.gap < reach;
            let weights = &body.model.samples[sample].weights;
            if candidate.gap < margin
                || (candidate.gap < ahead && candidate.gap < limits.approach_distance(nodes.speed(weights)))
            {
                out.push(candidate);
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

    /// Speed of a sample against the collider, m/s.
    fn speed(&self, weights: &[f64; 8]) -> f64 {
        weighted_mean(self.count, &self.v, weights).norm()
    }
}

/// Weighted mean over `count` nodes. The four nodes of a face are the common case, for which the sum is unrolled.
fn weighted_mean(count: usize, values: &[Vec3; 8], weights: &[f64; 8]) -> Vec3 {
    let over = |n: usize| (1..n).fold(values[0] * weights[0], |sum, i| sum + values[i] * weights[i]);
    if count <= 4 { over(4) } else { over(8) }
}

/// One sample against the surface, if it is within `near_surface` (collider frame) and the two face each other.
fn test_sample(
    body: &FemState,
    collider: &Collider,
    frame: &ColliderFrame,
    nodes: &LocalNodeGroup,
    group: usize,
    sample: usize,
    near_surface: &Aabb,
) -> Option<ContactCandidate> {
    let data = &body.model.samples[sample];
    let local = weighted_mean(nodes.count, &nodes.x, &data.weights);
    if !near_surface.contains(&local) {
        return None;
    }
    let facing = body.rotation[data.surface.at.element as usize] * data.surface.n_o;
    let local_facing = frame.to_world.tr_mul(&facing);
    let contact = collider.surface.contact(&local, &local_facing, data.surface.area.sqrt());
    // Normals that agree mean that the surface is behind the sample: the far side of a thin body.
    if contact.coverage <= 0.0 || local_facing.dot(&contact.normal) > 0.3 {
        return None;
    }
    Some(ContactCandidate {
        group,
        sample,
        p: frame.to_world * local + frame.origin,
        gap: contact.gap,
        normal: frame.to_world * contact.normal,
        coverage: contact.coverage,
    })
}
