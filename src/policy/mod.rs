//! What drives a rollout from outside: the policy's view and its answer, and how both are written for servers.

pub mod builtin;
mod chunked;
pub mod decode;
pub mod encode;
mod observation;
pub mod osc;
pub mod profile;
pub mod recorded;
pub mod remote;
pub mod wire;

use crate::geometry::Vec3;

pub use chunked::{ChunkedPolicy, CommandResolver};
pub use observation::{CameraImage, Observation, PadForce, SensorStreams, TactileFrame, TactileHistory};

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

/// What one of a chunk's actions commands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToolCommand {
    /// A pose.
    Pose(Action),
    /// A step away from where the tool is when its turn comes.
    Step {
        /// Whether it is carried out in full, or as far as robosuite's controller gets; see [`osc`].
        whole: bool,
        /// Translation in the base frame, m.
        translation_b: Vec3,
        /// Rotation about the axes of the base frame, rad.
        rotation_b: Vec3,
        /// Gripper closure.
        closure: f64,
    },
}

/// What a policy answers: the commands of the next control steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActionChunk {
    /// At least one, in order.
    pub commands: Vec<ToolCommand>,
}

impl From<Action> for ActionChunk {
    fn from(action: Action) -> Self {
        Self { commands: vec![ToolCommand::Pose(action)] }
    }
}

/// Which episode begins: what a policy is told of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskBrief {
    /// Suite.
    pub suite: String,
    /// Task index in the suite.
    pub task: usize,
    /// The instruction.
    pub prompt: String,
    /// Episode index in the task.
    pub episode: u32,
}

/// What goes wrong with a policy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolicyError {
    /// The server cannot be reached, or does not answer: the run ends.
    #[error("{0}")]
    Transport(String),
    /// The address is none: the user's input.
    #[error("{0}")]
    Address(String),
    /// The answer is not of the form that the profile says: the run ends.
    #[error("{0}")]
    Reply(String),
    /// An answer of the right form that cannot be carried out: the episode has failed, the run goes on.
    #[error("{0}")]
    Action(String),
    /// The policy's own script is wrong: the run ends.
    #[error("{0}")]
    Script(String),
    /// The run was told to stop.
    #[error("interrupted")]
    Interrupted,
}

/// A policy that acts on observations alone.
pub trait Policy: Send {
    /// Its name in results.
    fn name(&self) -> &str;
    /// What it looks at; nothing else is computed.
    fn streams(&self) -> SensorStreams {
        SensorStreams::default()
    }
    /// An episode begins.
    ///
    /// # Errors
    /// See [`PolicyError`].
    fn reset(&mut self, _brief: &TaskBrief) -> Result<(), PolicyError> {
        Ok(())
    }
    /// The commands of the next control steps.
    ///
    /// # Errors
    /// See [`PolicyError`].
    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError>;
    /// The episode is over; whether its goal was reached is not said. A policy that stays whole may be used again.
    fn finish(&mut self) {}
}
