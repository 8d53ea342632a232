//! The interface of a policy: its trait, the description of an episode, and commands.

use super::{Observation, SensorStreams};
use crate::{evaluation::episode_id::EpisodeIndex, geometry::Vec3};

/// Command of one control step: where the tool and the gripper should be at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action {
    /// Absolute tool position in the base frame, m.
    pub position_b: Vec3,
    /// Absolute tool orientation in the base frame as axis-angle, rad.
    pub axis_angle_b: Vec3,
    /// Gripper closure, 0 (open) ..= 1 (closed).
    pub closure: f64,
}

impl Action {
    /// Position, axis-angle and closure: the row of an action in recorded files.
    pub fn to_array(self) -> [f64; 7] {
        let (p, r) = (self.position_b, self.axis_angle_b);
        [p.x, p.y, p.z, r.x, r.y, r.z, self.closure]
    }

    /// Inverse of [`Self::to_array`].
    pub fn from_array([x, y, z, rx, ry, rz, closure]: [f64; 7]) -> Self {
        Self { position_b: Vec3::new(x, y, z), axis_angle_b: Vec3::new(rx, ry, rz), closure }
    }
}

/// One entry of an action chunk. [`CommandResolver`](super::CommandResolver) turns it into an [`Action`] in the
/// control step in which it is executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToolCommand {
    /// An absolute pose.
    Pose(Action),
    /// A displacement from the measured tool pose.
    Delta {
        /// True to command the displaced pose itself; false to command what robosuite's
        /// controller reaches, see [`osc`](super::osc).
        full: bool,
        /// Translation in the base frame, m.
        translation_b: Vec3,
        /// Rotation vector about the axes of the base frame, rad.
        rotation_b: Vec3,
        /// Gripper closure, 0 (open) ..= 1 (closed).
        closure: f64,
    },
}

/// Response of a policy: the commands of the next control steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActionChunk {
    /// At least one command, in order of execution.
    pub commands: Vec<ToolCommand>,
}

impl From<Action> for ActionChunk {
    fn from(action: Action) -> Self {
        Self { commands: vec![ToolCommand::Pose(action)] }
    }
}

/// Description of an episode, passed to a policy when the episode begins: its id without base seed and split, which
/// must not influence a policy, and its instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskBrief {
    /// Name of the suite.
    pub suite: String,
    /// Index of the task in the suite.
    pub task: usize,
    /// The instruction.
    pub prompt: String,
    /// Index of the episode in its split.
    pub episode: u32,
}

impl TaskBrief {
    /// Position of the episode in its run.
    pub fn index(&self) -> EpisodeIndex {
        EpisodeIndex { task: self.task, episode: self.episode }
    }
}

/// Failure of a policy. Only [`Action`](Self::Action) is confined to its episode; every other failure ends the run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolicyError {
    /// The server cannot be reached or does not respond.
    #[error("{0}")]
    Transport(String),
    /// The address of the server is invalid: an error in the user's input.
    #[error("{0}")]
    Address(String),
    /// The response does not have the form that the profile defines.
    #[error("{0}")]
    Reply(String),
    /// A response of the right form holds an action that cannot be executed. The episode fails; the run continues.
    #[error("{0}")]
    Action(String),
    /// The script of a Lua policy failed.
    #[error("{0}")]
    Script(String),
    /// The run was cancelled.
    #[error("interrupted")]
    Interrupted,
}

/// A policy that acts on observations alone.
///
/// An episode calls [`reset`](Self::reset) once, then [`act`](Self::act) each time a new [`ActionChunk`] is needed, and
/// [`finish`](Self::finish) at the end. [`ChunkedPolicy`](super::ChunkedPolicy) executes the chunks at 20 Hz.
///
/// ```
/// use softvt::policy::{Action, ActionChunk, Observation, Policy, PolicyError};
///
/// /// Descends by 5 mm per control step with the gripper open.
/// struct Descend;
///
/// impl Policy for Descend {
///     fn name(&self) -> &str {
///         "descend"
///     }
///
///     fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
///         let mut position_b = observation.ee_position_b;
///         position_b.z -= 0.005;
///         Ok(Action { position_b, axis_angle_b: observation.ee_axis_angle_b, closure: 0.0 }.into())
///     }
/// }
/// ```
pub trait Policy: Send {
    /// Name in results.
    fn name(&self) -> &str;
    /// Sensor streams of its observations. Other streams are not computed.
    fn streams(&self) -> SensorStreams {
        SensorStreams::default()
    }
    /// Prepares for an episode.
    ///
    /// # Errors
    /// See [`PolicyError`].
    fn reset(&mut self, _brief: &TaskBrief) -> Result<(), PolicyError> {
        Ok(())
    }
    /// Commands of the next control steps.
    ///
    /// # Errors
    /// See [`PolicyError`].
    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError>;
    /// Ends the episode. The result of the episode is not disclosed.
    fn finish(&mut self) {}
}
