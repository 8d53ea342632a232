//! What a policy answers to the observations of a demonstration.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex},
    time::Instant,
};

use softvt_common::parallel::lock;
use softvt_geometry::{Quat, Vec3};
use softvt_policy::{
    Action, ActionChunk, CommandResolver, EncodedGrip, EpisodeBrief, GripTarget, Observation, Policy,
    PolicyError, SensorStreams, ToolCommand, ToolMotion, decode,
    profile::{ActionEncoding, GripCode, GripperValues, PoseEncoding},
};
use softvt_robot::{ik::ArmAngles, rotation};

/// Commands of an answer whose path is kept: more say nothing of the rate.
const LONGEST_PATH: usize = 64;

/// A control step of a demonstration, as it was recorded.
#[derive(Clone, Copy, Debug)]
pub struct RecordedStep {
    /// The action.
    pub action: Action,
    /// Joint positions that the action means, rad, if they are known.
    pub joints: Option<ArmAngles>,
}

/// A measured pose of the tool in the base frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToolPose {
    pub position: Vec3,
    pub orientation: Quat,
}

impl ToolPose {
    fn of(observation: &Observation) -> Self {
        let robot = &observation.robot;
        let orientation = rotation::from_axis_angle(&robot.ee_axis_angle_b);
        Self { position: robot.ee_position_b, orientation }
    }
}

/// The answer to one control step of a demonstration.
#[derive(Clone, Debug)]
pub(super) struct StepSample {
    /// Control step of the demonstration.
    pub step: usize,
    /// Control step of the request.
    pub request_step: usize,
    /// Pose in the observation of the request.
    pub request: ToolPose,
    /// Pose when the action is executed.
    pub tool: ToolPose,
    /// Measured joint positions at the request, rad.
    pub request_joints: ArmAngles,
    /// The answer, decoded without clamping.
    pub answered: Action,
    /// True if the answer is a displacement of the tool.
    pub is_step: bool,
    /// Translation of a displacement of 1, m, if the encoding has one.
    pub step_m: Option<f64>,
    /// The numbers of the answer, in SI units, if it was decoded from numbers.
    pub row: Option<Vec<f64>>,
    /// Closure in the values of the encoding, neither clamped nor rounded to open or closed.
    pub closure: f64,
    pub recorded: RecordedStep,
}

/// One answer of the policy.
#[derive(Clone, Debug)]
pub(super) struct AnswerSample {
    /// Number of control steps before the request.
    pub step: usize,
    /// Position in the observation, m.
    pub start: Vec3,
    /// Positions to which the commands lead from the measured one, m.
    pub path: Vec<Vec3>,
    pub seconds: f64,
}

/// What was seen in one demonstration.
#[derive(Clone, Debug, Default)]
pub struct DemoSamples {
    pub(super) steps: Vec<StepSample>,
    pub(super) answers: Vec<AnswerSample>,
    pub(super) encoding: Option<ActionEncoding>,
    /// The error that ended the comparison.
    pub(super) failure: Option<String>,
}

/// A command of an answer that is not compared yet.
#[derive(Clone, Debug)]
struct PendingCommand {
    command: ToolCommand,
    row: Option<Vec<f64>>,
}

/// Comparison of a policy with the recorded steps of one demonstration, whatever it answers.
pub struct AnswerComparison {
    policy: Box<dyn Policy>,
    brief: Option<EpisodeBrief>,
    replan: usize,
    encoding: Option<ActionEncoding>,
    pending: VecDeque<PendingCommand>,
    request: Option<RequestSample>,
    resolver: CommandResolver,
    samples: Arc<Mutex<DemoSamples>>,
}

/// What the policy saw at its last request.
#[derive(Clone, Copy, Debug)]
struct RequestSample {
    step: usize,
    tool: ToolPose,
    joints: ArmAngles,
}

impl AnswerComparison {
    /// Compares `policy` in the episode `brief`, of whose answers at most `replan` commands are executed. `encoding` is
    /// that of its numbers. What is seen is added to `samples`.
    pub fn new(
        policy: Box<dyn Policy>,
        brief: EpisodeBrief,
        replan: usize,
        encoding: Option<ActionEncoding>,
        samples: Arc<Mutex<DemoSamples>>,
    ) -> Self {
        lock(&samples).encoding.clone_from(&encoding);
        Self {
            policy,
            brief: Some(brief),
            replan: replan.max(1),
            encoding,
            pending: VecDeque::new(),
            request: None,
            resolver: CommandResolver::default(),
            samples,
        }
    }

    /// Sensor streams that the policy observes.
    pub fn streams(&self) -> SensorStreams {
        self.policy.streams()
    }

    /// True if the policy needs the observation of the next control step.
    pub fn wants_observation(&self) -> bool {
        self.pending.is_empty() || self.policy.observes_every_step()
    }

    /// Compares one control step.
    ///
    /// # Errors
    /// The policy fails.
    pub fn step(&mut self, observation: &Observation, recorded: RecordedStep) -> Result<(), PolicyError> {
        let compared = self.compare(observation, recorded);
        if let Err(error) = &compared {
            lock(&self.samples).failure = Some(error.to_string());
        }
        compared
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
        let (Some(PendingCommand { command, row }), Some(request)) = (self.pending.pop_front(), self.request)
        else {
            return Err(PolicyError::Response("has no action at all".to_owned()));
        };
        let answered = self.resolver.resolve(observation, command);
        let mut samples = lock(&self.samples);
        let step = samples.steps.len();
        samples.steps.push(StepSample {
            step,
            request_step: request.step,
            request: request.tool,
            tool: ToolPose::of(observation),
            request_joints: request.joints,
            answered,
            is_step: matches!(command.motion, ToolMotion::Delta { .. }),
            step_m: self.encoding.as_ref().and_then(|encoding| match encoding.pose {
                PoseEncoding::Delta { translation_m, .. } | PoseEncoding::DeltaOsc { translation_m, .. } => {
                    Some(translation_m)
                }
                PoseEncoding::Absolute | PoseEncoding::Joints => None,
            }),
            closure: self.closure(&command, row.as_deref(), &answered),
            row: row.map(|row| self.in_si(&row)),
            recorded,
        });
        Ok(())
    }

    /// Ends the episode.
    ///
    /// # Errors
    /// The policy fails.
    pub fn finish(&mut self) -> Result<(), PolicyError> {
        self.policy.finish()
    }

    fn ask(&mut self, observation: &Observation) -> Result<(), PolicyError> {
        let asked = Instant::now();
        let ActionChunk { mut commands, rows } = self.policy.act(observation)?;
        let seconds = asked.elapsed().as_secs_f64();
        if let Some(encoding) = &self.encoding {
            for (command, row) in commands.iter_mut().zip(&rows) {
                command.motion = decode::unclamped_command(row, encoding)?.motion;
            }
        }
        let tool = ToolPose::of(observation);
        let mut samples = lock(&self.samples);
        let step = samples.steps.len();
        let path = path_of(observation, self.resolver, &commands);
        samples.answers.push(AnswerSample { step, start: tool.position, path, seconds });
        self.request = Some(RequestSample { step, tool, joints: observation.robot.joints });
        let mut rows = rows.into_iter();
        let pending = commands.into_iter().map(|command| PendingCommand { command, row: rows.next() });
        self.pending = pending.take(self.replan).collect();
        Ok(())
    }

    fn in_si(&self, row: &[f64]) -> Vec<f64> {
        let units = self.encoding.as_ref().and_then(|encoding| encoding.units.as_ref());
        let motion = row.len().saturating_sub(1);
        let si = |(i, number): (usize, &f64)| match units {
            Some(units) if i < motion => units.to_si(i, *number),
            _ => *number,
        };
        row.iter().enumerate().map(si).collect()
    }

    /// The closure that a command means in the values of the encoding.
    fn closure(&self, command: &ToolCommand, row: Option<&[f64]>, answered: &Action) -> f64 {
        let values = self.encoding.as_ref().map(|encoding| encoding.gripper);
        match (values, row.and_then(<[f64]>::last), command.grip) {
            (Some(GripperValues { open, closed, code, .. }), Some(value), _) if code != GripCode::Force => {
                (value - open) / (closed - open)
            }
            (_, _, EncodedGrip::TwoWidth(closure) | EncodedGrip::Target(GripTarget::Closure(closure))) => {
                closure
            }
            _ => answered.closure(),
        }
    }
}

/// Positions to which commands lead one after the other.
fn path_of(observation: &Observation, mut resolver: CommandResolver, commands: &[ToolCommand]) -> Vec<Vec3> {
    let start = observation.robot.ee_position_b;
    let mut at = start;
    let next = |command: &ToolCommand| {
        let target = resolver.resolve(observation, *command).position_b;
        at = match command.motion {
            ToolMotion::Delta { .. } => at + target - start,
            ToolMotion::Pose { .. } | ToolMotion::Joints(_) => target,
        };
        at
    };
    commands.iter().take(LONGEST_PATH).map(next).collect()
}
