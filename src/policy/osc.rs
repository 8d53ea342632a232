//! Displacements of the tool as robosuite's operational-space controller executes them.
//!
//! That controller sets its goal at a displacement δ from the measured pose in every control step and pulls the tool
//! towards it with a critically damped spring (kp 150 1/s², kd 2√kp; robosuite, controllers/osc.py, as LIBERO
//! configures it). The tool does not reach the goal within the 50 ms, and policies trained on such data expect the
//! distance that it does cover. The equation x'' = kp (g − x) − kd x' has the solution x(t) = g + e^{−ωt} ((x₀ − g) +
//! (v₀ + ω (x₀ − g)) t) with ω = √kp. Position and rotation vector both follow it.

use super::Action;
use softvt_benchmark::CONTROL_DT;
use softvt_geometry::{Quat, Vec3};
use softvt_robot::{GripTarget, rotation};

/// Stiffness of the spring, 1/s².
const KP: f64 = 150.0;

/// A tool pose displaced by a translation (m) and a rotation vector (rad) in the base frame: the
/// goal of robosuite's controller.
pub fn goal(
    position_b: Vec3,
    orientation_b: Quat,
    translation_b: Vec3,
    rotation_b: Vec3,
    grip: GripTarget,
) -> Action {
    let orientation = rotation::from_axis_angle(&rotation_b) * orientation_b;
    let (position_b, axis_angle_b) = (position_b + translation_b, rotation::axis_angle(&orientation));
    Action::of_pose(position_b, axis_angle_b, grip)
}

/// Distance that the spring covers in a control step towards a goal at `step`. Updates its velocity.
pub(crate) fn spring(step: &Vec3, velocity: &mut Vec3) -> Vec3 {
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
    fn the_closed_form_agrees_with_numerical_integration() {
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
    fn a_constant_displacement_ends_in_a_constant_speed() {
        // kp δ = kd v: 0.05 m per step is 0.31 m/s, not 1 m/s.
        let mut velocity = Vec3::zeros();
        let mut moved = Vec3::zeros();
        for _ in 0..200 {
            moved = spring(&Vec3::x().scale(0.05), &mut velocity);
        }
        assert!((moved.x / CONTROL_DT - velocity.x).abs() < 0.02, "{moved} {velocity}");
        assert!((0.2..0.4).contains(&velocity.x), "{velocity}");
    }
}
