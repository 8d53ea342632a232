//! The interface of an episode to its controller, and the controller that executes the action chunks of a policy.

use std::collections::{BTreeMap, VecDeque};

use super::simulation::Simulation;
use softvt_policy::{
    Action, ActionChunk, CommandResolver, EpisodeBrief, Observation, Policy, PolicyError, SensorStreams,
    ToolCommand,
};

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
    /// State of a controller that had not ended its task at the end of the budget, such as its last phase. `None` if it
    /// had ended, or has no end. Called once, after the last control step.
    fn unended(&mut self) -> Option<String> {
        None
    }
    /// Numbers that the controller notes in the record of the episode, by name.
    fn notes(&self) -> BTreeMap<String, f64> {
        BTreeMap::new()
    }
    /// Action of this control step, `None` to repeat the previous one.
    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, PolicyError>;
    /// Called once after the last control step.
    fn finish(&mut self) -> Result<(), PolicyError> {
        Ok(())
    }
}

/// A policy together with the execution of its chunks, one command per control step. Its observations have sensor
/// streams only in the control steps in which the policy is queried.
pub struct ChunkedPolicy<'a> {
    policy: Box<dyn Policy + 'a>,
    replan: usize,
    brief: Option<EpisodeBrief>,
    remaining: VecDeque<ToolCommand>,
    resolver: CommandResolver,
}

impl<'a> ChunkedPolicy<'a> {
    /// Runs `policy` in the episode `brief`. At most the first `replan` commands of each chunk are executed.
    pub fn new(policy: Box<dyn Policy + 'a>, brief: EpisodeBrief, replan: usize) -> Self {
        Self {
            policy,
            replan: replan.max(1),
            brief: Some(brief),
            remaining: VecDeque::new(),
            resolver: CommandResolver::default(),
        }
    }
}

impl Controller for ChunkedPolicy<'_> {
    fn streams(&self) -> SensorStreams {
        self.policy.streams()
    }

    fn wants_observation(&self) -> bool {
        self.remaining.is_empty() || self.policy.observes_every_step()
    }

    fn act(&mut self, _sim: &Simulation, observation: &Observation) -> Result<Option<Action>, PolicyError> {
        if let Some(brief) = self.brief.take() {
            self.policy.reset(&brief)?;
        }
        if self.remaining.is_empty() {
            let ActionChunk { mut commands, .. } = self.policy.act(observation)?;
            commands.truncate(self.replan);
            self.remaining = commands.into();
        } else if self.policy.observes_every_step() {
            self.policy.observe(observation)?;
        }
        let Some(command) = self.remaining.pop_front() else {
            return Err(PolicyError::Response("has no action at all".to_owned()));
        };
        Ok(Some(self.resolver.resolve(observation, command)))
    }

    fn finish(&mut self) -> Result<(), PolicyError> {
        self.policy.finish()
    }
}
