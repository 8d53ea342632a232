//! Whoever drives the robot, as an episode sees it.

use super::simulation::Simulation;
use crate::policy::{Action, ChunkedPolicy, Observation, PolicyError, SensorStreams};

/// What went wrong with whoever drives.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// A script failed: the user's input.
    #[error("{0}")]
    Script(String),
    /// A policy failed: the server or its answers.
    #[error("{0}")]
    Policy(String),
    /// A policy's answer cannot be carried out; this episode has failed and others may go on.
    #[error("{0}")]
    Action(String),
    /// The run was told to stop.
    #[error("interrupted")]
    Interrupted,
}

/// Whoever drives the robot: a policy behind its observation, or a privileged planner.
pub trait Controller {
    /// What it looks at, when it looks; the same for the whole episode.
    fn streams(&self) -> SensorStreams {
        SensorStreams::default()
    }
    /// Whether it looks in this control step; if not, nothing is sensed for it.
    fn wants_observation(&self) -> bool {
        true
    }
    /// Why it has given up, if it has: the last action stays then.
    fn gave_up(&self) -> Option<&str> {
        None
    }
    /// The action of this control step; `None` to keep the last one.
    ///
    /// # Errors
    /// What went wrong.
    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError>;
    /// The episode is over.
    fn finish(&mut self) {}
}

/// A policy sees the observation and nothing else.
impl Controller for ChunkedPolicy<'_> {
    fn streams(&self) -> SensorStreams {
        ChunkedPolicy::streams(self)
    }

    fn wants_observation(&self) -> bool {
        ChunkedPolicy::wants_observation(self)
    }

    fn act(&mut self, _sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError> {
        ChunkedPolicy::act(self, observation).map(Some).map_err(ControlError::from)
    }

    fn finish(&mut self) {
        ChunkedPolicy::finish(self);
    }
}

impl From<PolicyError> for ControlError {
    fn from(error: PolicyError) -> Self {
        match error {
            PolicyError::Transport(message) | PolicyError::Reply(message) => Self::Policy(message),
            PolicyError::Action(message) => Self::Action(message),
            PolicyError::Script(message) | PolicyError::Address(message) => Self::Script(message),
            PolicyError::Interrupted => Self::Interrupted,
        }
    }
}
