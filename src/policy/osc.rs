//! Displacements of the tool as robosuite's operational-space controller executes them.
//!
//! That controller sets its goal at a displacement δ from the measured pose in every control step and pulls the tool
//! towards it with a critically damped spring (kp 150 1/s², kd 2√kp; robosuite, controllers/osc.py, as LIBERO
//! configures it). The tool does not reach the goal within the 50 ms, and policies trained on such data expect the
//! distance that it does cover. The equation x'' = kp (g − x) − kd x' has the solution x(t) = g + e^{−ωt} ((x₀ − g) +
//! (v₀ + ω (x₀ − g)) t) with ω = √kp. Position and rotation vector both follow it.

use super::{Action, EncodedGrip, GripSwitch, Observation, ToolCommand, ToolMotion, WidthLatch};
use softvt_benchmark::CONTROL_DT;
use softvt_geometry::{Quat, Vec3};
use softvt_robot::{GripTarget, rotation};

/// Stiffness of the spring, 1/s².
const KP: f64 = 150.0;

/// Turns a sequence of commands into actions. Stateful, because a displacement executed by robosuite's controller
/// depends on the velocity after the previous one, and a width in the code two-width is held.
#[derive(Clone, Copy, Debug, Default)]
pub struct CommandResolver {
    /// Velocities of the tool between two control steps, as the spring leaves them; zero after other commands.
    velocity: Vec3,
    angular_velocity: Vec3,
    latch: WidthLatch,
    switch: GripSwitch,
}

impl CommandResolver {
    /// The action that `command` means in the control step of `observation`.
    pub fn resolve(&mut self, observation: &Observation, command: ToolCommand) -> Action {
        let grip = match command.grip {
            EncodedGrip::Target(target) => target,
            EncodedGrip::TwoWidth(answer) => GripTarget::Closure(self.latch.closure(answer)),
            EncodedGrip::Latched { closes, hold_steps } => {
                GripTarget::Closure(self.switch.closure(closes, hold_steps))
            }
        };
        match command.motion {
            ToolMotion::Pose { position_b, axis_angle_b } => {
                self.stop();
                Action { position_b, axis_angle_b, grip }
            }
            ToolMotion::Delta { full, translation_b, rotation_b } => {
                let (translation_b, rotation_b) = if full {
                    self.stop();
                    (translation_b, rotation_b)
                } else {
                    let moved = spring(&translation_b, &mut self.velocity);
                    (moved, spring(&rotation_b, &mut self.angular_velocity))
                };
                let orientation_b = rotation::from_axis_angle(&observation.robot.ee_axis_angle_b);
                goal(observation.robot.ee_position_b, orientation_b, translation_b, rotation_b, grip)
            }
        }
    }

    fn stop(&mut self) {
        (self.velocity, self.angular_velocity) = (Vec3::zeros(), Vec3::zeros());
    }
}

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
    Action { position_b: position_b + translation_b, axis_angle_b: rotation::axis_angle(&orientation), grip }
}

/// Distance that the spring covers in a control step towards a goal at `step`. Updates its velocity.
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
