//! Finds the samples of a soft body that are near a collider.

use super::collider::Collider;
use crate::{
    geometry::{Pose, Vec3, shape::Aabb},
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

/// Steps of approach within which a sample gets a row.
const AHEAD: f64 = 1.5;

/// Collects the candidates of `body` against `collider` into `out`, in sample order, and calls `near` with every group
/// that is within `reach` of it, so that its nodes can be kept before they are needed.
pub fn detect(
    body: &SoftBody,
    collider: &Collider,
    moving: &Moving,
    (dt, margin, reach): (f64, f64, f64),
    out: &mut Vec<Candidate>,
    near: &mut dyn FnMut(usize),
) {
    let rest = &body.rest;
    let bounds = collider.bounds;
    let around = Aabb::around(&body.x).unwrap_or(bounds);
    let lever = (around.centre() - moving.origin).norm() + around.size().norm();
    let speed = body.max_speed() + moving.linear.norm() + moving.angular.norm() * lever;
    if apart(&around, &bounds.moved(&moving.pose), reach.max(AHEAD * dt * speed)) {
        return;
    }
    for (index, group) in rest.groups.iter().enumerate() {
        let nodes = &group.nodes[..group.count];
        let (low, high, fastest) = span(body, nodes, moving);
        let ahead = AHEAD * dt * fastest;
        let centre = moving.pose.inverse_transform_point(&((low + high) * 0.5).into()).coords;
        let radius = (high - low).norm() * 0.5;
        if outside(&bounds, &centre) > radius + reach.max(ahead) {
            continue;
        }
        let mut close = false;
        for sample in group.first..group.last {
            let Some(found) = test(body, collider, moving, (index, sample), dt) else { continue };
            close |= found.1 < reach;
            if found.1 < margin.max(found.2) {
                out.push(found.0);
            }
        }
        if close {
            near(index);
        }
    }
}

/// One sample against the surface: the candidate, its gap, and how far it may come in the look-ahead.
fn test(
    body: &SoftBody,
    collider: &Collider,
    moving: &Moving,
    (group, sample): (usize, usize),
    dt: f64,
) -> Option<(Candidate, f64, f64)> {
    let rest = &body.rest;
    let nodes = &rest.groups[group].nodes[..rest.groups[group].count];
    let data = &rest.samples[sample];
    let (mut p, mut v) = (Vec3::zeros(), Vec3::zeros());
    for (&node, w) in nodes.iter().zip(&data.weights) {
        p += body.x[node as usize] * *w;
        v += body.v[node as usize] * *w;
    }
    let facing = body.rotation[data.surface.at.element as usize] * data.surface.n_o;
    let local = moving.pose.inverse_transform_point(&p.into()).coords;
    let local_facing = moving.pose.rotation.inverse_transform_vector(&facing);
    let contact = collider.surface.contact(&local, &local_facing, data.surface.area.sqrt());
    let normal = moving.pose.rotation * contact.normal;
    // A sample that looks the way the surface does has it behind its back: the far side of a thin body.
    if contact.coverage <= 0.0 || facing.dot(&normal) > 0.3 {
        return None;
    }
    let approach = AHEAD * dt * (v - moving.velocity(&p)).norm();
    let candidate = Candidate { group, sample, p, gap: contact.phi, normal, coverage: contact.coverage };
    Some((candidate, contact.phi, approach))
}

/// Bounds of some nodes and their largest speed against the mover.
fn span(body: &SoftBody, nodes: &[u32], moving: &Moving) -> (Vec3, Vec3, f64) {
    let first = body.x[nodes[0] as usize];
    let mut result = (first, first, 0.0);
    for &node in nodes {
        let x = &body.x[node as usize];
        result.0 = result.0.inf(x);
        result.1 = result.1.sup(x);
        result.2 = f64::max(result.2, (body.v[node as usize] - moving.velocity(x)).norm());
    }
    result
}

fn apart(a: &Aabb, b: &Aabb, reach: f64) -> bool {
    (0..3).any(|i| a.min[i] > b.max[i] + reach || b.min[i] > a.max[i] + reach)
}

/// Distance of a point to a box; 0 inside.
fn outside(bounds: &Aabb, p: &Vec3) -> f64 {
    (bounds.min - p).sup(&(p - bounds.max)).sup(&Vec3::zeros()).norm()
}
