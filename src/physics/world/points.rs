//! The one way from two surfaces that meet to a point of the problem.

use super::Touch;
use crate::{
    geometry::Vec3,
    physics::{
        contact::{Friction, Layer},
        solver::Point,
    },
};

/// Where and how two surfaces meet, whatever they belong to.
pub(super) struct Meeting {
    /// Place, m, world.
    pub p: Vec3,
    /// Unit normal, world.
    pub normal: Vec3,
    /// Gap, m.
    pub gap: f64,
    /// Area that the point stands for, m².
    pub area: f64,
    /// How far the tangential spring is stretched, m, world; a part along the normal does not count.
    pub stretch: Vec3,
    /// Normal impulse of the last step, N s.
    pub impulse: f64,
    /// Whether the two slide on each other.
    pub sliding: bool,
}

impl Meeting {
    /// The point between surfaces of this friction and these layers in series; without weights and drift.
    pub(super) fn point(&self, friction: &Friction, layer: &Layer) -> Point {
        Point {
            weights_a: [0.0; 8],
            weights_b: [0.0; 8],
            p: self.p,
            normal: self.normal,
            drift: Vec3::zeros(),
            stiffness: layer.normal * self.area,
            shear_stiffness: layer.shear * self.area,
            gap: self.gap,
            offset: self.stretch - self.normal * self.normal.dot(&self.stretch),
            mu: if self.sliding { friction.dynamic_mu } else { friction.static_mu },
            lagged: self.impulse,
            normal_impulse: 0.0,
            shear_impulse: Vec3::zeros(),
            velocity: Vec3::zeros(),
            slipping: false,
        }
    }
}

/// How the tangential spring of a solved point ends the step: its stretch (m, world) if nothing slid, and how much of
/// that, along it, is beyond what friction holds and was slid (m).
pub(super) fn slid(point: &Point, dt: f64) -> (Vec3, f64) {
    let tangential = point.velocity - point.normal * point.normal.dot(&point.velocity);
    let stretch = point.offset + tangential * dt;
    if !point.slipping {
        return (stretch, 0.0);
    }
    let allowed = point.mu * point.lagged / (dt * point.shear_stiffness).max(f64::MIN_POSITIVE);
    (stretch, (stretch.norm() - allowed).max(0.0))
}

/// Adds a point to what a body was told of a partner; `sign` is −1 for the side that the normal points away from.
pub(super) fn add_touch(
    touches: &mut Vec<(u32, Touch)>,
    partner: u32,
    (point, travel): (&Point, f64),
    (sign, dt): (f64, f64),
) {
    let at = touches.iter().position(|(id, _)| *id == partner).unwrap_or_else(|| {
        touches.push((partner, Touch::default()));
        touches.len() - 1
    });
    let touch = &mut touches[at].1;
    let force = point.normal_impulse / dt;
    touch.samples += 1;
    touch.slipping += usize::from(point.slipping);
    touch.travel = (touch.travel * touch.normal_force + travel * force) / (touch.normal_force + force);
    touch.normal_force += force;
    touch.force_w += sign * (point.normal * point.normal_impulse + point.shear_impulse) / dt;
    touch.capacity += point.mu * force;
}
