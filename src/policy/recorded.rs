//! Actions that were recorded before, carried out again.

use super::{Action, ActionChunk, Observation, Policy, PolicyError};

/// Carries out recorded actions, one a control step.
#[derive(Clone, Debug)]
pub struct Recorded {
    actions: std::vec::IntoIter<Action>,
    last: Option<Action>,
    ending: Option<String>,
}

impl Recorded {
    /// Behind the last of `actions` it stays there; or fails as the recorded episode did, if that is given.
    pub fn new(actions: Vec<Action>, ending: Option<String>) -> Self {
        Self { actions: actions.into_iter(), last: None, ending }
    }
}

impl Policy for Recorded {
    fn name(&self) -> &str {
        "replay"
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        if let Some(action) = self.actions.next() {
            self.last = Some(action);
            return Ok(action.into());
        }
        if let Some(message) = &self.ending {
            return Err(PolicyError::Action(message.clone()));
        }
        let (position_b, axis_angle_b) = (observation.ee_position_b, observation.ee_axis_angle_b);
        Ok(self.last.unwrap_or(Action { position_b, axis_angle_b, closure: 0.0 }).into())
    }
}
