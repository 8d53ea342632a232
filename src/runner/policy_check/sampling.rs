//! The answers of a policy to the observations of a demonstration.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex},
    time::Instant,
};

use softvt_common::parallel::lock;
use softvt_geometry::{Quat, Vec3};
use softvt_policy::{
    Action, ActionChunk, CommandResolver, EpisodeBrief, Observation, Policy, PolicyError, SensorStreams,
    ToolCommand, ToolMotion,
    profile::{ActionEncoding, GripCode, GripperValues},
};
use softvt_robot::{ik::ArmAngles, rotation};
use softvt_rollout::{Controller, Simulation};

/// A control step of a demonstration, as it was recorded.
#[derive(Clone, Copy, Debug)]
pub struct RecordedStep {
    pub action: Action,
    /// Joint positions that the action means, rad, if they are known.
    pub joints: Option<ArmAngles>,
}

/// The answer in a control step of a demonstration.
#[derive(Clone, Debug)]
pub(super) struct StepSample {
    pub request: usize,
    /// Observed position of the tool in the base frame, m.
    pub tool: Vec3,
    pub tool_orientation: Quat,
    /// Measured joint positions, rad.
    pub measured_joints: ArmAngles,
    /// The answer, decoded without clamping.
    pub answered: Action,
    /// True if the answer is a displacement of the tool.
    pub is_step: bool,
    /// The numbers of the motion as the profile reads them: m and rad.
    pub numbers: Vec<f64>,
    /// Closure in the values of the encoding, neither clamped nor rounded to open or closed.
    pub closure: f64,
    pub recorded: RecordedStep,
}

/// The answers of a policy in one demonstration.
#[derive(Clone, Debug, Default)]
pub struct DemoSamples {
    pub(super) steps: Vec<StepSample>,
    /// Time of each answer, s.
    pub(super) answer_s: Vec<f64>,
    pub(super) grip_code: GripCode,
    pub(super) failure: Option<String>,
}

/// A command of an answer that is not compared yet.
#[derive(Clone, Debug)]
struct PendingCommand {
    command: ToolCommand,
    /// Its closure in the values of the encoding, if it was decoded from numbers.
    closure: Option<f64>,
}

/// A controller that asks a policy, compares its answers with the recorded steps of one demonstration, and
/// executes the recorded actions.
pub struct AnswerComparison {
    policy: Box<dyn Policy>,
    brief: Option<EpisodeBrief>,
    replan: usize,
    encoding: Option<ActionEncoding>,
    recorded: VecDeque<RecordedStep>,
    pending: VecDeque<PendingCommand>,
    request: usize,
    resolver: CommandResolver,
    samples: Arc<Mutex<DemoSamples>>,
}

impl Controller for AnswerComparison {
    fn streams(&self) -> SensorStreams {
        self.policy.streams()
    }

    fn wants_observation(&self) -> bool {
        self.pending.is_empty() || self.policy.observes_every_step()
    }

    fn act(&mut self, _sim: &Simulation, observation: &Observation) -> Result<Option<Action>, PolicyError> {
        self.compare_next(observation)
    }

    fn finish(&mut self) -> Result<(), PolicyError> {
        self.policy.finish()
    }
}

impl AnswerComparison {
    /// Compares `policy` in the episode `brief` with the steps `recorded`. Of its answers at most `replan` commands
    /// count, whose numbers have the encoding `encoding`. The answers are added to `samples`.
    pub fn new(
        policy: Box<dyn Policy>,
        brief: EpisodeBrief,
        replan: usize,
        encoding: Option<ActionEncoding>,
        recorded: Vec<RecordedStep>,
        samples: Arc<Mutex<DemoSamples>>,
    ) -> Self {
        lock(&samples).grip_code = encoding.as_ref().map_or(GripCode::default(), |code| code.gripper.code);
        Self {
            policy,
            brief: Some(brief),
            replan: replan.max(1),
            encoding,
            recorded: recorded.into(),
            pending: VecDeque::new(),
            request: 0,
            resolver: CommandResolver::default(),
            samples,
        }
    }

    /// Compares the next control step. Returns its recorded action, `None` after the last one.
    pub fn compare_next(&mut self, observation: &Observation) -> Result<Option<Action>, PolicyError> {
        let Some(recorded) = self.recorded.pop_front() else { return Ok(None) };
        let compared = self.compare(observation, recorded);
        if let Err(error) = &compared {
            lock(&self.samples).failure = Some(error.to_string());
        }
        compared.map(|()| Some(recorded.action))
    }

    fn compare(&mut self, observation: &Observation, recorded: RecordedStep) -> Result<(), PolicyError> {
        if let Some(brief) = self.brief.take() {
            self.policy.reset(&brief)?;
        }
        if self.pending.is_empty() {
            self.ask(observation)?;
        } else if self.policy.observes_every_step() {
            self.policy.observe(observation)?;
        }
        let Some(PendingCommand { command, closure }) = self.pending.pop_front() else {
            return Err(PolicyError::Response("has no action at all".to_owned()));
        };
        let answered = self.resolver.resolve(observation, command);
        let robot = &observation.robot;
        let of_vectors = |linear: Vec3, angular: Vec3| linear.iter().chain(&angular).copied().collect();
        lock(&self.samples).steps.push(StepSample {
            request: self.request,
            tool: robot.ee_position_b,
            tool_orientation: rotation::from_axis_angle(&robot.ee_axis_angle_b),
            measured_joints: robot.joints,
            answered,
            is_step: matches!(command.motion, ToolMotion::Delta { .. }),
            numbers: match command.motion {
                ToolMotion::Pose { position_b, axis_angle_b } => of_vectors(position_b, axis_angle_b),
                ToolMotion::Delta { translation_b, rotation_b, .. } => of_vectors(translation_b, rotation_b),
                ToolMotion::Joints(joints) => joints.to_vec(),
            },
            closure: closure.unwrap_or_else(|| answered.closure()),
            recorded,
        });
        Ok(())
    }

    fn ask(&mut self, observation: &Observation) -> Result<(), PolicyError> {
        let asked = Instant::now();
        let ActionChunk { commands, encoded } = self.policy.act(observation)?;
        let mut samples = lock(&self.samples);
        samples.answer_s.push(asked.elapsed().as_secs_f64());
        self.request = samples.steps.len();
        self.pending =
            commands.into_iter().map(|command| PendingCommand { command, closure: None }).collect();
        if let Some(encoding) = &self.encoding {
            let GripperValues { open, closed, code, .. } = encoding.gripper;
            for (pending, action) in self.pending.iter_mut().zip(&encoded) {
                pending.command.motion = action.unclamped_motion(encoding);
                let closure = (action.grip - open) / (closed - open);
                pending.closure = (code != GripCode::Force).then_some(closure);
            }
        }
        self.pending.truncate(self.replan);
        Ok(())
    }
}
