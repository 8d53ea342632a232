//! Steps away from where the tool is, as robosuite's operational-space controller makes them.
//!
//! That controller sets its goal a step δ away from the measured pose at every control step and pulls the tool there by a
//! critically damped spring (kp 150 1/s², kd 2√kp; robosuite, controllers/osc.py, as LIBERO configures it). It does not
//! arrive within the 50 ms: what the policy was trained on is the way the spring goes, x'' = kp (g − x) − kd x', whose
//! solution is x(t) = g + e^{−ωt} ((x₀ − g) + (v₀ + ω (x₀ − g)) t) with ω = √kp. Position and rotation vector both follow it.

use super::{Action, Observation};
use crate::{
    benchmark::control::CONTROL_DT,
    geometry::{Quat, Vec3},
    robot::rotation,
};

/// Stiffness of the spring, 1/s².
const KP: f64 = 150.0;

/// Velocities of the tool between two steps, as the spring left them.
#[derive(Clone, Copy, Debug, Default)]
pub struct OscController {
    velocity: Vec3,
    spin: Vec3,
}

impl OscController {
    /// The pose at the end of a control step whose goal is a step away from where the tool is now.
    pub fn step(&mut self, now: &Observation, translation_b: Vec3, rotation_b: Vec3, closure: f64) -> Action {
        let moved = spring(&translation_b, &mut self.velocity);
        let turned = spring(&rotation_b, &mut self.spin);
        whole(now, moved, turned, closure)
    }
}

/// The pose a step away from where the tool is now.
pub fn whole(now: &Observation, translation_b: Vec3, rotation_b: Vec3, closure: f64) -> Action {
    let tool_b = (now.ee_position_b, rotation::from_axis_angle(&now.ee_axis_angle_b));
    goal(tool_b, translation_b, rotation_b, closure)
}

/// The pose a step away from a place and an orientation of the tool: the goal that robosuite's controller sets itself. The
/// turn is about the axes of the base.
pub fn goal((at_b, turned_b): (Vec3, Quat), translation_b: Vec3, rotation_b: Vec3, closure: f64) -> Action {
    let orientation = rotation::from_axis_angle(&rotation_b) * turned_b;
    Action { position_b: at_b + translation_b, axis_angle_b: rotation::axis_angle(&orientation), closure }
}

/// How far the spring gets towards a goal `step` away in a control step; leaves it with its velocity then.
fn spring(step: &Vec3, velocity: &mut Vec3) -> Vec3 {
    let (omega, t) = (KP.sqrt(), CONTROL_DT);
    let decay = (-omega * t).exp();
    let slope = *velocity - step * omega;
    let moved = step + (slope * t - step) * decay;
    *velocity = (slope - (slope * t - step) * omega) * decay;
    moved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_is_what_the_spring_does_in_small_steps() {
        let step = Vec3::new(0.05, -0.02, 0.0);
        let (mut x, mut v, dt) = (Vec3::zeros(), Vec3::new(0.1, 0.0, -0.3), 1e-6);
        let mut velocity = v;
        let moved = spring(&step, &mut velocity);
        for _ in 0..50_000 {
            v += ((step - x) * KP - v * (2.0 * KP.sqrt())) * dt;
            x += v * dt;
        }
        assert!((x - moved).norm() < 1e-6 && (v - velocity).norm() < 1e-4, "{x} {moved} {v} {velocity}");
    }

    #[test]
    fn a_constant_step_ends_in_a_constant_speed() {
        // kp δ = kd v: 0.05 m a step is 0.31 m/s, not 1 m/s.
        let mut velocity = Vec3::zeros();
        let mut moved = Vec3::zeros();
        for _ in 0..200 {
            moved = spring(&Vec3::x().scale(0.05), &mut velocity);
        }
        assert!((moved.x / CONTROL_DT - velocity.x).abs() < 0.02, "{moved} {velocity}");
        assert!((0.2..0.4).contains(&velocity.x), "{velocity}");
    }
}
