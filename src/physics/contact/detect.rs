//! Finds the samples of a soft body that are near a collider.

use super::collider::Collider;
use crate::{
    geometry::{Aabb, Mat3, Pose, Vec3},
    physics::fem::SoftBody,
};

/// A sample near a surface, at the start of the step.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// Sample group of the body.
    pub group: usize,
    /// Sample of the body.
    pub sample: usize,
    /// Where the sample is, m, world.
    pub p: Vec3,
    /// Gap, m.
    pub gap: f64,
    /// Outward normal of the surface, world.
    pub normal: Vec3,
    /// Share of the sample's patch that the surface covers.
    pub coverage: f64,
}

/// Where a collider is and how its mover moves.
#[derive(Clone, Copy, Debug)]
pub struct Moving {
    /// Collider frame in the world.
    pub pose: Pose,
    /// Velocity of the mover's origin, m/s.
    pub linear: Vec3,
    /// Angular velocity, rad/s.
    pub angular: Vec3,
    /// The mover's origin, m, world.
    pub origin: Vec3,
}

impl Moving {
    /// Velocity of the mover's point at `p`, m/s.
    pub fn velocity(&self, p: &Vec3) -> Vec3 {
        self.linear + self.angular.cross(&(p - self.origin))
    }
}

/// Where a body and its sample groups are at the start of a step, which is the same for all colliders.
#[derive(Clone, Debug, Default)]
pub struct Whereabouts {
    body: Option<Aabb>,
    groups: Vec<Aabb>,
    fastest: f64,
}

impl Whereabouts {
    /// Looks where `body` is.
    pub fn look(&mut self, body: &SoftBody) {
        self.body = Aabb::from_points(&body.x);
        self.fastest = body.max_speed();
        self.groups.clear();
        self.groups.extend(body.rest.groups.iter().map(|group| {
            let first = body.x[group.nodes[0] as usize];
            let nodes = group.nodes[1..group.count].iter().map(|&node| &body.x[node as usize]);
            nodes.fold(Aabb { min: first, max: first }, |Aabb { min, max }, x| Aabb {
                min: min.inf(x),
                max: max.sup(x),
            })
        }));
    }
}

/// Steps of approach within which a sample gets a row.
const AHEAD: f64 = 1.5;

/// Collects the candidates of `body` against `collider` into `out`, in sample order, and calls `near` with every group
/// that is within `reach` of it, so that its nodes can be kept before they are needed.
pub fn detect(
    (body, whereabouts): (&SoftBody, &Whereabouts),
    collider: &Collider,
    moving: &Moving,
    (dt, margin, reach): (f64, f64, f64),
    out: &mut Vec<Candidate>,
    near: &mut dyn FnMut(usize),
) {
    let bounds = collider.bounds;
    let around = whereabouts.body.unwrap_or(bounds);
    let lever = (around.centre() - moving.origin).norm() + around.size().norm();
    let speed = whereabouts.fastest + moving.linear.norm() + moving.angular.norm() * lever;
    let near_collider = bounds.transformed(&moving.pose).loosened(reach.max(AHEAD * dt * speed));
    if !around.intersects(&near_collider) {
        return;
    }
    let view = View::new(moving);
    for (index, (group, around)) in body.rest.groups.iter().zip(&whereabouts.groups).enumerate() {
        if !around.intersects(&near_collider) {
            continue;
        }
        let seen = Seen::new(body, &group.nodes[..group.count], moving, &view);
        let ahead = AHEAD * dt * seen.fastest;
        let look = reach.max(ahead);
        let near_surface = bounds.loosened(look);
        if !seen.bounds.intersects(&near_surface) {
            continue;
        }
        let mut close = false;
        for sample in group.first..group.last {
            let Some(candidate) = test(body, collider, (&seen, &view), (index, sample), &near_surface) else {
                continue;
            };
            close |= candidate.gap < reach;
            let weights = &body.rest.samples[sample].weights;
            if candidate.gap < margin
                || (candidate.gap < ahead && candidate.gap < AHEAD * dt * seen.speed(weights))
            {
                out.push(candidate);
            }
        }
        if close {
            near(index);
        }
    }
}

/// A collider's frame in the world.
struct View {
    to_world: Mat3,
    origin: Vec3,
}

impl View {
    fn new(moving: &Moving) -> Self {
        Self {
            to_world: *moving.pose.rotation.to_rotation_matrix().matrix(),
            origin: moving.pose.translation.vector,
        }
    }
}

/// The nodes of a group as a collider sees them, in its frame.
struct Seen {
    count: usize,
    x: [Vec3; 8],
    v: [Vec3; 8],
    bounds: Aabb,
    fastest: f64,
}

impl Seen {
    fn new(body: &SoftBody, nodes: &[u32], moving: &Moving, view: &View) -> Self {
        let mut seen = Self {
            count: nodes.len(),
            x: [Vec3::zeros(); 8],
            v: [Vec3::zeros(); 8],
            bounds: Aabb { min: Vec3::repeat(f64::INFINITY), max: Vec3::repeat(f64::NEG_INFINITY) },
            fastest: 0.0,
        };
        for (i, &node) in nodes.iter().enumerate() {
            let x = &body.x[node as usize];
            seen.x[i] = view.to_world.tr_mul(&(x - view.origin));
            seen.v[i] = body.v[node as usize] - moving.velocity(x);
            seen.bounds.min = seen.bounds.min.inf(&seen.x[i]);
            seen.bounds.max = seen.bounds.max.sup(&seen.x[i]);
            seen.fastest = seen.fastest.max(seen.v[i].norm_squared());
        }
        seen.fastest = seen.fastest.sqrt();
        seen
    }

    /// Speed of a sample against the mover, m/s.
    fn speed(&self, weights: &[f64; 8]) -> f64 {
        mean(self.count, &self.v, weights).norm()
    }
}

/// Weighted mean over `count` nodes; with the four of a face known, the sum is unrolled.
fn mean(count: usize, values: &[Vec3; 8], weights: &[f64; 8]) -> Vec3 {
    let of = |n: usize| (1..n).fold(values[0] * weights[0], |sum, i| sum + values[i] * weights[i]);
    if count <= 4 { of(4) } else { of(8) }
}

/// One sample against the surface, if it is within `near_surface` and the two face each other.
fn test(
    body: &SoftBody,
    collider: &Collider,
    (seen, view): (&Seen, &View),
    (group, sample): (usize, usize),
    near_surface: &Aabb,
) -> Option<Candidate> {
    let data = &body.rest.samples[sample];
    let local = mean(seen.count, &seen.x, &data.weights);
    if !near_surface.contains(&local) {
        return None;
    }
    let facing = body.rotation[data.surface.at.element as usize] * data.surface.n_o;
    let local_facing = view.to_world.tr_mul(&facing);
    let contact = collider.surface.contact(&local, &local_facing, data.surface.area.sqrt());
    // A sample that looks the way the surface does has it behind its back: the far side of a thin body.
    if contact.coverage <= 0.0 || local_facing.dot(&contact.normal) > 0.3 {
        return None;
    }
    Some(Candidate {
        group,
        sample,
        p: view.to_world * local + view.origin,
        gap: contact.phi,
        normal: view.to_world * contact.normal,
        coverage: contact.coverage,
    })
}
