//! The interface of an episode to its controller.

use super::simulation::Simulation;
use crate::policy::{Action, ChunkedPolicy, Observation, PolicyError, SensorStreams};

/// Failure of a controller.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// A script failed: an error in the user's input.
    #[error("{0}")]
    Script(String),
    /// A policy server failed or sent an invalid response.
    #[error("{0}")]
    Policy(String),
    /// The controller returned an action that cannot be executed. The episode fails; the run continues.
    #[error("{0}")]
    Action(String),
    /// The run was cancelled.
    #[error("interrupted")]
    Interrupted,
}

/// Controls the robot during an episode. Implemented by observation-only policies and by privileged experts.
///
/// [`Episode::run`](super::Episode::run) calls [`act`](Self::act) once per control step (20 Hz) with the
/// simulation and an [`Observation`]. A policy uses the observation alone; an expert may read the true
/// state from the simulation. The sensors in [`streams`](Self::streams) are computed only in steps for
/// which [`wants_observation`](Self::wants_observation) is true.
pub trait Controller {
    /// Sensor streams of its observations, the same for the whole episode.
    fn streams(&self) -> SensorStreams {
        SensorStreams::default()
    }
    /// True if the sensor streams are needed in this control step. Otherwise the observation has proprioception alone.
    fn wants_observation(&self) -> bool {
        true
    }
    /// Reason why the controller aborted its task, if it did. The last action is then held until the episode ends.
    fn gave_up(&self) -> Option<&str> {
        None
    }
    /// Action of this control step, `None` to repeat the previous one.
    ///
    /// # Errors
    /// [`ControlError::Action`] ends the episode with the outcome `error`; any other error ends the run.
    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError>;
    /// Called once after the last control step.
    fn finish(&mut self) {}
}

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

/// A controller that fails with [`ControlError::Interrupted`] once the process is [cancelled](super::cancel).
pub struct Cancellable(pub Box<dyn Controller>);

impl Controller for Cancellable {
    fn streams(&self) -> SensorStreams {
        self.0.streams()
    }

    fn wants_observation(&self) -> bool {
        self.0.wants_observation()
    }

    fn gave_up(&self) -> Option<&str> {
        self.0.gave_up()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError> {
        if super::cancel::requested() {
            return Err(ControlError::Interrupted);
        }
        self.0.act(sim, observation)
    }

    fn finish(&mut self) {
        self.0.finish();
    }
}
