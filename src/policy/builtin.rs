//! Policies without a model: two baselines that must fail, and the replay of recorded commands.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{Action, ActionChunk, Observation, Policy, PolicyError, ToolCommand, ToolMotion};
use softvt_benchmark::seed::uniform;
use softvt_geometry::Vec3;

/// Holds the initial tool pose with the gripper open.
#[derive(Debug, Default)]
pub struct NoopPolicy {
    hold: Option<Action>,
}

impl Policy for NoopPolicy {
    fn name(&self) -> &str {
        "noop"
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        Ok((*self.hold.get_or_insert_with(|| tool_pose(observation))).into())
    }
}

/// Largest displacement per control step along each axis, m.
const MAX_STEP: f64 = 0.02;
/// Probability per control step of a new random closure.
const CLOSURE_CHANGE: f64 = 0.05;

/// Random walk of the tool over the table, with random closures.
#[derive(Debug)]
pub struct RandomPolicy {
    rng: ChaCha8Rng,
    closure: f64,
    axis_angle_b: Option<Vec3>,
}

impl RandomPolicy {
    /// The walk of a seed.
    pub fn new(seed: u64) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), closure: 0.0, axis_angle_b: None }
    }
}

impl Policy for RandomPolicy {
    fn name(&self) -> &str {
        "random"
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let axis_angle_b = *self.axis_angle_b.get_or_insert(observation.robot.ee_axis_angle_b);
        let step = Vec3::from_fn(|_, _| MAX_STEP * (2.0 * uniform(&mut self.rng) - 1.0));
        let mut position_b = observation.robot.ee_position_b + step;
        // Above the table top and below the shoulder: the walk would get stuck at the table.
        position_b.z = position_b.z.clamp(0.03, 0.5);
        if uniform(&mut self.rng) < CLOSURE_CHANGE {
            self.closure = uniform(&mut self.rng);
        }
        Ok(Action::new(position_b, axis_angle_b, self.closure).into())
    }
}

/// Replays recorded commands, one per control step.
#[derive(Clone, Debug)]
pub struct RecordedPolicy {
    commands: std::vec::IntoIter<ToolCommand>,
    last: Option<ToolCommand>,
    ending: Option<String>,
}

impl RecordedPolicy {
    /// Replays `commands`. After the last one the policy fails with the message `ending`, as the recorded episode
    /// did, or holds the tool where it is if `ending` is `None`.
    pub fn new(commands: Vec<ToolCommand>, ending: Option<String>) -> Self {
        Self { commands: commands.into_iter(), last: None, ending }
    }

    /// Replays absolute poses and joint positions; see [`new`](Self::new).
    pub fn from_actions(actions: &[Action], ending: Option<String>) -> Self {
        Self::new(actions.iter().copied().map(ToolCommand::from).collect(), ending)
    }
}

impl Policy for RecordedPolicy {
    fn name(&self) -> &str {
        "replay"
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        if let Some(command) = self.commands.next() {
            self.last = Some(command);
            return Ok(vec![command].into());
        }
        if let Some(message) = &self.ending {
            return Err(PolicyError::Action(message.clone()));
        }
        let still = tool_pose(observation).into();
        Ok(vec![self.last.map_or(still, held)].into())
    }
}

/// The command that keeps the tool where `command` has brought it.
fn held(command: ToolCommand) -> ToolCommand {
    let motion = match command.motion {
        fixed @ (ToolMotion::Pose { .. } | ToolMotion::Joints(_)) => fixed,
        ToolMotion::Delta { full, .. } => ToolMotion::Delta {
            full,
            translation_b: Vec3::zeros(),
            rotation_b: Vec3::zeros(),
            is_clamped: false,
        },
    };
    ToolCommand { motion, ..command }
}

fn tool_pose(observation: &Observation) -> Action {
    Action::new(observation.robot.ee_position_b, observation.robot.ee_axis_angle_b, 0.0)
}
