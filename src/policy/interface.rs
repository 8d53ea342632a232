//! The interface of a policy: its trait, the description of an episode, and commands.

use sha2::{Digest, Sha256};

use super::{Observation, SensorStreams};
use softvt_common::episode_id::EpisodeIndex;
use softvt_geometry::{Pose, Vec3};
use softvt_robot::{GripTarget, ik::ArmAngles, panda, rotation};

/// Command of one control step: where the tool and the gripper should be at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action {
    /// Absolute tool position in the base frame, m.
    pub position_b: Vec3,
    /// Absolute tool orientation in the base frame as axis-angle, rad.
    pub axis_angle_b: Vec3,
    /// Arm joint positions (rad) that are commanded directly; the pose is the tool's there. `None` for a pose
    /// that inverse kinematics turns into joint positions.
    pub joints: Option<ArmAngles>,
    /// Target of the gripper. The hand clamps closures outside of 0..=1, which the record counts; a grip force is at
    /// most the effort of the gripper.
    pub grip: GripTarget,
    /// True if it is a displacement whose answer was out of range, and clamped.
    pub is_clamped: bool,
}

impl Action {
    pub fn new(position_b: Vec3, axis_angle_b: Vec3, closure: f64) -> Self {
        Self::of_pose(position_b, axis_angle_b, GripTarget::Closure(closure))
    }

    pub fn of_pose(position_b: Vec3, axis_angle_b: Vec3, grip: GripTarget) -> Self {
        Self { position_b, axis_angle_b, joints: None, grip, is_clamped: false }
    }

    /// An action that commands arm joint positions, rad.
    pub fn of_joints(joints: ArmAngles, grip: GripTarget) -> Self {
        let tool_b = panda::tool_pose(&joints);
        let (position_b, axis_angle_b) = (tool_b.translation.vector, rotation::axis_angle(&tool_b.rotation));
        Self { joints: Some(joints), ..Self::of_pose(position_b, axis_angle_b, grip) }
    }

    /// Gripper closure, 0 (open) ..= 1 (closed); 1 with a grip force.
    pub fn closure(&self) -> f64 {
        match self.grip {
            GripTarget::Closure(closure) => closure,
            GripTarget::Force(_) => 1.0,
        }
    }

    /// Grip force at which closing stops, N; `None` for a closure.
    pub fn force_n(&self) -> Option<f64> {
        match self.grip {
            GripTarget::Closure(_) => None,
            GripTarget::Force(force_n) => Some(force_n),
        }
    }

    pub fn pose_b(&self) -> Pose {
        Pose::from_parts(self.position_b.into(), rotation::from_axis_angle(&self.axis_angle_b))
    }

    /// All numbers of the action: [`Self::to_array`], and the grip force and the joint positions
    /// if it commands them.
    pub fn numbers(self) -> impl Iterator<Item = f64> {
        self.to_array().into_iter().chain(self.force_n()).chain(self.joints.into_iter().flatten())
    }

    /// Position, axis-angle and closure: the row of an action in recorded files.
    pub fn to_array(self) -> [f64; 7] {
        let (p, r) = (self.position_b, self.axis_angle_b);
        [p.x, p.y, p.z, r.x, r.y, r.z, self.closure()]
    }

    /// Inverse of [`Self::to_array`], without a grip force and joint positions.
    pub fn from_array([x, y, z, rx, ry, rz, closure]: [f64; 7]) -> Self {
        Self::new(Vec3::new(x, y, z), Vec3::new(rx, ry, rz), closure)
    }
}

/// One entry of an action chunk. [`CommandResolver`](super::CommandResolver) turns it into an [`Action`] in the
/// control step in which it is executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolCommand {
    pub motion: ToolMotion,
    pub grip: EncodedGrip,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToolMotion {
    Pose {
        /// Position in the base frame, m.
        position_b: Vec3,
        /// Orientation in the base frame as axis-angle, rad.
        axis_angle_b: Vec3,
    },
    Joints(ArmAngles),
    /// A displacement from the measured tool pose.
    Delta {
        /// True to command the displaced pose itself; false to command what robosuite's
        /// controller reaches, see [`osc`](super::osc).
        full: bool,
        /// Translation in the base frame, m.
        translation_b: Vec3,
        /// Rotation vector about the axes of the base frame, rad.
        rotation_b: Vec3,
        /// True if numbers of the answer were beyond −1..=1 by more than a tenth of that range. They are clamped.
        is_clamped: bool,
    },
}

/// Command of the gripper in a [`ToolCommand`], as the grip code of a profile reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncodedGrip {
    Target(GripTarget),
    /// The closure of an answer in the code two-width, see [`GripLatch`](super::GripLatch).
    TwoWidth(f64),
    /// Open or closed with the whole effort, with hysteresis, see [`GripLatch`](super::GripLatch).
    Latched {
        /// True to close, false to open, `None` to stay.
        closes: Option<bool>,
        /// Control steps for which a change is kept whatever is answered.
        hold_steps: u32,
    },
}

impl From<Action> for ToolCommand {
    fn from(action: Action) -> Self {
        let Action { position_b, axis_angle_b, joints, grip, .. } = action;
        let pose = ToolMotion::Pose { position_b, axis_angle_b };
        Self { motion: joints.map_or(pose, ToolMotion::Joints), grip: EncodedGrip::Target(grip) }
    }
}

/// Response of a policy: the commands of the next control steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActionChunk {
    /// At least one command, in order of execution.
    pub commands: Vec<ToolCommand>,
    /// The numbers that each command was decoded from; empty if it was not.
    pub encoded: Vec<EncodedAction>,
}

/// The numbers of an action in the encoding of a profile, without padding.
#[derive(Clone, Debug, PartialEq)]
pub struct EncodedAction {
    /// Pose, displacement or joint positions of the arm.
    pub motion: Vec<f64>,
    pub grip: f64,
}

impl From<Vec<ToolCommand>> for ActionChunk {
    fn from(commands: Vec<ToolCommand>) -> Self {
        Self { commands, encoded: Vec::new() }
    }
}

impl From<Action> for ActionChunk {
    fn from(action: Action) -> Self {
        vec![ToolCommand::from(action)].into()
    }
}

/// Description of an episode, passed to a policy when the episode begins: its id without base seed and split, which
/// must not influence a policy, and its instruction.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EpisodeBrief {
    pub suite: String,
    pub task: usize,
    pub prompt: String,
    pub episode: u32,
    /// Seed of the run. It may influence the random numbers of a policy alone.
    pub seed: u64,
    /// Name of the episode in a judged run. Policies then receive it in place of suite, task, episode and seed, from
    /// which the draws of other runs can be computed.
    pub alias: Option<String>,
}

/// Identity of a request for actions, for policies that draw random numbers: the same request of a repeated or resumed
/// run has the same identity, whatever the number of threads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct QueryId {
    /// The episode. Its alias, if it has one, is sent in place of suite, task, episode and seed.
    pub brief: EpisodeBrief,
    /// Control step of the episode.
    pub step: u32,
    /// Number of earlier requests for actions in the episode.
    pub query: u32,
    /// False if the observation is sent for the history of the policy alone, and no action is expected.
    pub wants_actions: bool,
}

impl QueryId {
    /// The first request of an episode.
    pub fn first(brief: &EpisodeBrief) -> Self {
        Self { brief: brief.clone(), wants_actions: true, ..Self::default() }
    }

    /// Seed of the request, by the key of SoftVTBench's release v0.2: the first four bytes, big-endian, of the SHA-256
    /// of the parts joined by the byte 0x1f. A demonstration is named demo_K there, K being the episode here. In a
    /// judged run the only part of an episode is its alias.
    pub fn seed(&self) -> u32 {
        let EpisodeBrief { suite, task, episode, seed, alias, .. } = &self.brief;
        let demo = format!("demo_{episode}");
        let episode = match alias {
            Some(alias) => seed_of("episode", std::slice::from_ref(alias)),
            None => seed_of("episode", &[seed.to_string(), suite.clone(), task.to_string(), demo]),
        };
        seed_of("inference", &[episode.to_string(), self.query.to_string()])
    }
}

fn seed_of(kind: &str, parts: &[String]) -> u32 {
    let all = ["softvtbench-sha256-u32-v1", kind].into_iter().chain(parts.iter().map(String::as_str));
    let text = all.collect::<Vec<_>>().join("\x1f");
    let hash = Sha256::digest(text.as_bytes());
    u32::from_be_bytes([hash[0], hash[1], hash[2], hash[3]])
}

impl EpisodeBrief {
    pub fn index(&self) -> EpisodeIndex {
        EpisodeIndex { task: self.task, episode: self.episode }
    }
}

/// Failure of a policy. Only [`Action`](Self::Action) is confined to its episode; every other failure ends the run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolicyError {
    /// The connection to the server failed, or the server does not respond as its protocol requires.
    #[error("the policy server {url} {problem}")]
    Server {
        url: String,
        /// The problem, after the subject "the policy server".
        problem: String,
    },
    /// No server accepted a connection in time.
    #[error(
        "no policy server at {url}: {reason}; tried for {seconds} s: start it, or allow it more time (--policy-timeout)"
    )]
    Unreachable { url: String, reason: String, seconds: String },
    /// Something other than a websocket server listens at the address.
    #[error("{url} is not a websocket server: {reason}")]
    NotWebsocket { url: String, reason: String },
    /// The address of the server is invalid: an error in the user's input.
    #[error("the policy server {url:?}: {problem}; expected ws://HOST:PORT")]
    Address { url: String, problem: String },
    /// The response does not have the form that the profile defines. The text continues "the policy's reply".
    #[error("the policy's reply {0}")]
    Response(String),
    /// A response of the right form holds an action that cannot be executed; its text becomes the outcome's. The
    /// episode fails; the run continues.
    #[error("{0}")]
    Action(String),
    /// The script of a Lua policy or of an expert failed: an error in the user's input, with the message of the script.
    #[error("{0}")]
    Script(String),
    #[error("interrupted")]
    Interrupted,
}

impl PolicyError {
    /// True if a policy server is at fault, not the user's input.
    pub fn is_server_fault(&self) -> bool {
        matches!(
            self,
            Self::Server { .. } | Self::Unreachable { .. } | Self::NotWebsocket { .. } | Self::Response(_)
        )
    }
}

/// A policy that acts on observations alone.
///
/// An episode calls [`reset`](Self::reset) once, then [`act`](Self::act) each time a new [`ActionChunk`] is needed, and
/// [`finish`](Self::finish) at the end. `ChunkedPolicy` of the layer `rollout` executes the chunks at 20 Hz.
///
/// ```
/// use softvt_policy::{Action, ActionChunk, Observation, Policy, PolicyError};
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
///         let mut position_b = observation.robot.ee_position_b;
///         position_b.z -= 0.005;
///         Ok(Action::new(position_b, observation.robot.ee_axis_angle_b, 0.0).into())
///     }
/// }
/// ```
pub trait Policy: Send {
    /// Name of the policy in results.
    fn name(&self) -> &str;
    /// Sensor streams of its observations. Other streams are not computed.
    fn streams(&self) -> SensorStreams {
        SensorStreams::default()
    }
    /// Prepares for an episode.
    fn reset(&mut self, _brief: &EpisodeBrief) -> Result<(), PolicyError> {
        Ok(())
    }
    /// True if [`observe`](Self::observe) is to be called in every control step without a call of [`act`](Self::act).
    fn observes_every_step(&self) -> bool {
        false
    }
    /// Receives the observation of a control step in which no commands are needed.
    fn observe(&mut self, _observation: &Observation) -> Result<(), PolicyError> {
        Ok(())
    }
    /// Commands of the next control steps.
    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError>;
    /// Ends the episode. The result of the episode is not disclosed.
    ///
    /// # Errors
    /// The policy finds that its earlier commands are not valid; the episode is then not recorded.
    fn finish(&mut self) -> Result<(), PolicyError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_are_those_of_the_released_key() {
        // Computed with Python's hashlib from the description of the release.
        let suite = "object_soft".to_owned();
        let brief = EpisodeBrief { suite, task: 3, episode: 80, seed: 11, ..EpisodeBrief::default() };
        let first = QueryId::first(&brief);
        let second = QueryId { query: 1, step: 10, ..first.clone() };
        assert_eq!((first.seed(), second.seed()), (1_728_023_119, 3_567_768_914));
        assert_eq!(QueryId { step: 5, ..second.clone() }.seed(), second.seed(), "the step does not matter");
    }
}
