//! Chunks of actions carried out one by one: a policy is asked anew when enough of its last answer is spent.

use std::collections::VecDeque;

use super::{
    Action, ActionChunk, Observation, Policy, PolicyError, SensorStreams, TaskBrief, ToolCommand, osc,
    osc::OscController,
};

/// A policy whose chunks are carried out.
pub struct ChunkedPolicy<'a> {
    policy: Box<dyn Policy + 'a>,
    /// Actions of a chunk that are carried out.
    replan: usize,
    brief: Option<TaskBrief>,
    rest: VecDeque<ToolCommand>,
    follower: CommandResolver,
}

/// Commands become poses one after another: a step away from where the tool is remembers how fast the last one left it.
#[derive(Clone, Debug, Default)]
pub struct CommandResolver {
    osc: OscController,
}

impl CommandResolver {
    /// The pose that a command means when its turn comes.
    pub fn action(&mut self, now: &Observation, command: ToolCommand) -> Action {
        match command {
            ToolCommand::Pose(action) => {
                self.osc = OscController::default();
                action
            }
            ToolCommand::Step { whole: true, translation_b, rotation_b, closure } => {
                self.osc = OscController::default();
                osc::whole(now, translation_b, rotation_b, closure)
            }
            ToolCommand::Step { whole: false, translation_b, rotation_b, closure } => {
                self.osc.step(now, translation_b, rotation_b, closure)
            }
        }
    }
}

impl<'a> ChunkedPolicy<'a> {
    /// `policy` in the episode `brief`; the first `replan` actions of each of its chunks are carried out, or all if they are
    /// fewer.
    pub fn new(policy: Box<dyn Policy + 'a>, brief: TaskBrief, replan: usize) -> Self {
        Self {
            policy,
            replan: replan.max(1),
            brief: Some(brief),
            rest: VecDeque::new(),
            follower: CommandResolver::default(),
        }
    }

    /// What the policy looks at, when it looks.
    pub fn streams(&self) -> SensorStreams {
        self.policy.streams()
    }

    /// Whether the policy is asked in this control step; in others nothing need be sensed for it.
    pub fn wants_observation(&self) -> bool {
        self.rest.is_empty()
    }

    /// The action of this control step.
    ///
    /// # Errors
    /// The policy's.
    pub fn act(&mut self, observation: &Observation) -> Result<Action, PolicyError> {
        if let Some(brief) = self.brief.take() {
            self.policy.reset(&brief)?;
        }
        if self.rest.is_empty() {
            let ActionChunk { mut commands } = self.policy.act(observation)?;
            commands.truncate(self.replan);
            self.rest = commands.into();
        }
        let command = self.rest.pop_front();
        let command = command
            .ok_or_else(|| PolicyError::Reply("the policy's reply has no action at all".to_owned()))?;
        Ok(self.follower.action(observation, command))
    }

    /// The episode is over.
    pub fn finish(&mut self) {
        self.policy.finish();
    }
}
