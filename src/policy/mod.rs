//! What judges and drives a rollout from outside: the policy's view and its answer.

pub mod builtin;
mod observation;

use crate::geometry::Vec3;

pub use observation::{CameraPicture, Observation, PadForce, Streams, TouchFrame, TouchHistory};

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
    /// What it looks at now; nothing else is computed.
    fn streams(&self) -> Streams {
        Streams::default()
    }
    /// The action for this control step.
    ///
    /// # Errors
    /// What went wrong, as one message.
    fn act(&mut self, observation: &Observation) -> Result<Action, String>;
}
