//! Chunks of actions carried out one by one: a policy is asked anew when enough of its last answer is spent.

use std::collections::VecDeque;

use super::{
    Action, ActionChunk, Command, Observation, Policy, PolicyError, Streams, TaskBrief, osc, osc::Osc,
};

/// A policy whose chunks are carried out.
pub struct Chunked<'a> {
    policy: Box<dyn Policy + 'a>,
    /// Actions of a chunk that are carried out.
    replan: usize,
    brief: Option<TaskBrief>,
    rest: VecDeque<Command>,
    osc: Osc,
}

impl<'a> Chunked<'a> {
    /// `policy` in the episode `brief`; the first `replan` actions of each of its chunks are carried out, or all if they are
    /// fewer.
    pub fn new(policy: Box<dyn Policy + 'a>, brief: TaskBrief, replan: usize) -> Self {
        Self { policy, replan: replan.max(1), brief: Some(brief), rest: VecDeque::new(), osc: Osc::default() }
    }

    /// What the policy looks at, when it looks.
    pub fn streams(&self) -> Streams {
        self.policy.streams()
    }

    /// Whether the policy is asked in this control step; in others nothing need be sensed for it.
    pub fn looks(&self) -> bool {
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
        match self.rest.pop_front() {
            Some(Command::Pose(action)) => {
                self.osc = Osc::default();
                Ok(action)
            }
            Some(Command::Step { whole: true, translation_b, rotation_b, closure }) => {
                self.osc = Osc::default();
                Ok(osc::whole(observation, translation_b, rotation_b, closure))
            }
            Some(Command::Step { whole: false, translation_b, rotation_b, closure }) => {
                Ok(self.osc.step(observation, translation_b, rotation_b, closure))
            }
            None => Err(PolicyError::Reply("the policy's reply has no action at all".to_owned())),
        }
    }

    /// The episode is over.
    pub fn finish(&mut self) {
        self.policy.finish();
    }
}
