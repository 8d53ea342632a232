//! What judges and drives a rollout from outside: the policy's view and its answer.

pub mod builtin;

use crate::geometry::Vec3;

/// What a policy is allowed to see at a control step. Hidden state is not in this type.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Time since the policy took over, s.
    pub time_s: f64,
    /// Tool position in the robot base frame, m.
    pub ee_position_b: Vec3,
    /// Tool orientation in the base frame as axis-angle, rad.
    pub ee_axis_angle_b: Vec3,
    /// Arm joint angles, rad.
    pub joints: [f64; 7],
    /// Measured gripper width, m.
    pub gripper_width_m: f64,
    /// Closure last commanded, 0..=1.
    pub closure: f64,
    /// The instruction.
    pub prompt: String,
}

/// What a policy commands for one control step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action {
    /// Absolute tool position in the base frame, m.
    pub position_b: Vec3,
    /// Absolute tool orientation in the base frame as axis-angle, rad.
    pub axis_angle_b: Vec3,
    /// Gripper closure, 0 (open) ..= 1 (shut).
    pub closure: f64,
}

/// A policy that acts on observations alone.
pub trait Policy: Send {
    /// Its name in results.
    fn name(&self) -> &str;
    /// The action for this control step.
    ///
    /// # Errors
    /// What went wrong, as one message.
    fn act(&mut self, observation: &Observation) -> Result<Action, String>;
}
