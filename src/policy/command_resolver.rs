//! [`CommandResolver`]: from the commands of a policy to the actions that the robot executes.

use super::{Action, EncodedGrip, GripLatch, Observation, ToolCommand, ToolMotion, osc};
use softvt_geometry::Vec3;
use softvt_robot::{GripTarget, rotation};

/// Turns a sequence of commands into actions. Stateful, because a displacement executed by robosuite's controller
/// depends on the velocity after the previous one, and a width in the code two-width is held.
#[derive(Clone, Copy, Debug, Default)]
pub struct CommandResolver {
    /// Velocities of the tool between two control steps, as the spring leaves them; zero after other commands.
    velocity: Vec3,
    angular_velocity: Vec3,
    latch: GripLatch,
}

impl CommandResolver {
    /// The action that `command` means in the control step of `observation`.
    pub fn resolve(&mut self, observation: &Observation, command: ToolCommand) -> Action {
        let grip = match command.grip {
            EncodedGrip::Target(target) => target,
            EncodedGrip::TwoWidth(answer) => GripTarget::Closure(self.latch.two_width(answer)),
            EncodedGrip::Latched { closes, hold_steps } => {
                GripTarget::Closure(self.latch.switched(closes, hold_steps))
            }
        };
        match command.motion {
            ToolMotion::Pose { position_b, axis_angle_b } => {
                self.stop();
                Action::of_pose(position_b, axis_angle_b, grip)
            }
            ToolMotion::Joints(joints) => {
                self.stop();
                Action::of_joints(joints, grip)
            }
            ToolMotion::Delta { full, translation_b, rotation_b, is_clamped } => {
                let (translation_b, rotation_b) = if full {
                    self.stop();
                    (translation_b, rotation_b)
                } else {
                    let moved = osc::spring(&translation_b, &mut self.velocity);
                    (moved, osc::spring(&rotation_b, &mut self.angular_velocity))
                };
                let orientation_b = rotation::from_axis_angle(&observation.robot.ee_axis_angle_b);
                let at = observation.robot.ee_position_b;
                Action { is_clamped, ..osc::goal(at, orientation_b, translation_b, rotation_b, grip) }
            }
        }
    }

    fn stop(&mut self) {
        (self.velocity, self.angular_velocity) = (Vec3::zeros(), Vec3::zeros());
    }
}
