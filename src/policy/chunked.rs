//! Execution of action chunks: a policy is queried again after `replan` commands of its last chunk.

use std::collections::VecDeque;

use super::{
    Action, ActionChunk, Observation, Policy, PolicyError, SensorStreams, TaskBrief, ToolCommand,
    osc::{self, OscController},
};

/// A policy together with the execution of its chunks, one command per control step.
pub struct ChunkedPolicy<'a> {
    policy: Box<dyn Policy + 'a>,
    replan: usize,
    brief: Option<TaskBrief>,
    remaining: VecDeque<ToolCommand>,
    resolver: CommandResolver,
}

/// Turns a sequence of commands into absolute poses. Stateful, because a displacement executed by robosuite's
/// controller depends on the velocity after the previous one.
#[derive(Clone, Debug, Default)]
pub struct CommandResolver {
    osc: OscController,
}

impl CommandResolver {
    /// The pose that `command` means in the control step of `observation`.
    pub fn resolve(&mut self, observation: &Observation, command: ToolCommand) -> Action {
        match command {
            ToolCommand::Pose(action) => {
                self.osc = OscController::default();
                action
            }
            ToolCommand::Delta { full: true, translation_b, rotation_b, closure } => {
                self.osc = OscController::default();
                osc::displaced(observation, translation_b, rotation_b, closure)
            }
            ToolCommand::Delta { full: false, translation_b, rotation_b, closure } => {
                self.osc.step(observation, translation_b, rotation_b, closure)
            }
        }
    }
}

impl<'a> ChunkedPolicy<'a> {
    /// Runs `policy` in the episode `brief`. At most the first `replan` commands of each chunk are executed.
    pub fn new(policy: Box<dyn Policy + 'a>, brief: TaskBrief, replan: usize) -> Self {
        Self {
            policy,
            replan: replan.max(1),
            brief: Some(brief),
            remaining: VecDeque::new(),
            resolver: CommandResolver::default(),
        }
    }

    /// Sensor streams of the policy.
    pub fn streams(&self) -> SensorStreams {
        self.policy.streams()
    }

    /// True if the policy is queried in this control step. In other steps its sensor streams are not needed.
    pub fn wants_observation(&self) -> bool {
        self.remaining.is_empty()
    }

    /// Action of this control step.
    ///
    /// # Errors
    /// The errors of the policy, and [`PolicyError::Reply`] for an empty chunk.
    pub fn act(&mut self, observation: &Observation) -> Result<Action, PolicyError> {
        if let Some(brief) = self.brief.take() {
            self.policy.reset(&brief)?;
        }
        if self.remaining.is_empty() {
            let ActionChunk { mut commands } = self.policy.act(observation)?;
            commands.truncate(self.replan);
            self.remaining = commands.into();
        }
        let command = self.remaining.pop_front();
        let command = command
            .ok_or_else(|| PolicyError::Reply("the policy's reply has no action at all".to_owned()))?;
        Ok(self.resolver.resolve(observation, command))
    }

    /// Ends the episode.
    pub fn finish(&mut self) {
        self.policy.finish();
    }
}
