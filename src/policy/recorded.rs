//! Commands that were recorded before, carried out again.

use super::{Action, ActionChunk, Observation, Policy, PolicyError, ToolCommand};
use crate::geometry::Vec3;

/// Carries out recorded commands, one a control step.
#[derive(Clone, Debug)]
pub struct RecordedPolicy {
    commands: std::vec::IntoIter<ToolCommand>,
    last: Option<ToolCommand>,
    ending: Option<String>,
}

impl RecordedPolicy {
    /// Behind the last of `commands` the tool stays there; or fails as the recorded episode did, if that is given.
    pub fn new(commands: Vec<ToolCommand>, ending: Option<String>) -> Self {
        Self { commands: commands.into_iter(), last: None, ending }
    }

    /// The same for poses.
    pub fn poses(actions: &[Action], ending: Option<String>) -> Self {
        Self::new(actions.iter().copied().map(ToolCommand::Pose).collect(), ending)
    }
}

/// What keeps the tool where a command has brought it.
fn held(command: ToolCommand) -> ToolCommand {
    match command {
        ToolCommand::Pose(_) => command,
        ToolCommand::Step { whole, closure, .. } => {
            ToolCommand::Step { whole, translation_b: Vec3::zeros(), rotation_b: Vec3::zeros(), closure }
        }
    }
}

impl Policy for RecordedPolicy {
    fn name(&self) -> &str {
        "replay"
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        if let Some(command) = self.commands.next() {
            self.last = Some(command);
            return Ok(ActionChunk { commands: vec![command] });
        }
        if let Some(message) = &self.ending {
            return Err(PolicyError::Action(message.clone()));
        }
        let (position_b, axis_angle_b) = (observation.ee_position_b, observation.ee_axis_angle_b);
        let still = ToolCommand::Pose(Action { position_b, axis_angle_b, closure: 0.0 });
        Ok(ActionChunk { commands: vec![self.last.map_or(still, held)] })
    }
}
