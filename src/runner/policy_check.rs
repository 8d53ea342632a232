//! Comparison of a policy's answers with the actions of demonstrations that it should know.
//!
//! The demonstrations are simulated again. At every request the policy sees the observation of a run, and its answer is
//! compared with the recorded action, which is executed. Actions are compared as displacements from the measured tool
//! pose.

use std::{
    path::Path,
    sync::{Arc, Mutex},
    time::Instant,
};

use serde::Serialize;

use crate::{
    error::RunError,
    observer::Observer,
    policy::{ControllerFactory, PolicyConfig},
    replay::{DemoRef, check_complete, demos_of, simulate_demo_with},
    suite_run::policy_failure,
};
use softvt_common::{parallel::lock, text::counted};
use softvt_evaluation::statistics::quantile;
use softvt_geometry::{Mat3, Quat, Vec3};
use softvt_policy::{
    Action, ActionChunk, EpisodeBrief, Observation, Policy, PolicyError, SensorStreams, ToolCommand,
    ToolMotion,
};
use softvt_robot::{
    ik::ArmAngles,
    panda::{self, JointRange},
    rotation,
};
use softvt_rollout::{ChunkedPolicy, Controller, Simulation};

const NOT_COMPARABLE: &str = "only policy servers and policies in Lua can be compared with demonstrations";

/// Correlation above which answers and recorded actions agree.
const AGREES: f64 = 0.5;
/// Correlation above which another reading of the answers explains them.
const EXPLAINS: f64 = 0.7;
/// Factors between answers and recorded actions that agree.
const AGREEING_SCALES: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// Displacements below which a translation or rotation says nothing, m and rad.
const LEAST_TRANSLATION_M: f64 = 1e-3;
const LEAST_ROTATION_RAD: f64 = 5e-3;

/// The answer to one control step of a demonstration.
#[derive(Clone, Copy, Debug)]
struct StepSample {
    tool_position_b: Vec3,
    tool_orientation_b: Quat,
    answered: Action,
    recorded: Action,
}

/// One answer of the policy.
#[derive(Clone, Debug)]
struct AnswerSample {
    /// Number of control steps before the request.
    step: usize,
    /// Positions to which the commands lead from the measured one, m.
    path_b: Vec<Vec3>,
    seconds: f64,
}

/// What was seen in one demonstration.
#[derive(Clone, Debug, Default)]
struct DemoSamples {
    steps: Vec<StepSample>,
    answers: Vec<AnswerSample>,
}

/// A policy whose answers are kept.
struct SampledPolicy {
    policy: Box<dyn Policy>,
    samples: Arc<Mutex<DemoSamples>>,
}

impl Policy for SampledPolicy {
    fn name(&self) -> &str {
        self.policy.name()
    }

    fn streams(&self) -> SensorStreams {
        self.policy.streams()
    }

    fn reset(&mut self, brief: &EpisodeBrief) -> Result<(), PolicyError> {
        self.policy.reset(brief)
    }

    fn observes_every_step(&self) -> bool {
        self.policy.observes_every_step()
    }

    fn observe(&mut self, observation: &Observation) -> Result<(), PolicyError> {
        self.policy.observe(observation)
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let asked = Instant::now();
        let chunk = self.policy.act(observation)?;
        let seconds = asked.elapsed().as_secs_f64();
        let path_b = path_of(observation.robot.ee_position_b, &chunk.commands);
        let mut samples = lock(&self.samples);
        let step = samples.steps.len();
        samples.answers.push(AnswerSample { step, path_b, seconds });
        Ok(chunk)
    }

    fn finish(&mut self) -> Result<(), PolicyError> {
        self.policy.finish()
    }
}

/// Executes recorded actions in place of those that a policy answers.
struct ComparingController {
    answers: ChunkedPolicy<'static>,
    recorded: std::vec::IntoIter<Action>,
    samples: Arc<Mutex<DemoSamples>>,
}

impl Controller for ComparingController {
    fn streams(&self) -> SensorStreams {
        self.answers.streams()
    }

    fn wants_observation(&self) -> bool {
        self.answers.wants_observation()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, PolicyError> {
        let Some(recorded) = self.recorded.next() else { return Ok(None) };
        let Some(answered) = self.answers.act(sim, observation)? else { return Ok(Some(recorded)) };
        lock(&self.samples).steps.push(StepSample {
            tool_position_b: observation.robot.ee_position_b,
            tool_orientation_b: rotation::from_axis_angle(&observation.robot.ee_axis_angle_b),
            answered,
            recorded,
        });
        Ok(Some(recorded))
    }

    fn finish(&mut self) -> Result<(), PolicyError> {
        self.answers.finish()
    }
}

/// Positions to which commands lead one after the other.
fn path_of(start_b: Vec3, commands: &[ToolCommand]) -> Vec<Vec3> {
    let mut at_b = start_b;
    let next = |command: &ToolCommand| {
        at_b = match command.motion {
            ToolMotion::Pose { position_b, .. } => position_b,
            ToolMotion::Joints(joints) => panda::tool_pose(&joints).translation.vector,
            ToolMotion::Delta { translation_b, .. } => at_b + translation_b,
        };
        at_b
    };
    commands.iter().map(next).collect()
}

/// How far answers agree with recorded actions in one respect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AnswerAgreement {
    /// Number of control steps that were compared.
    pub n: usize,
    /// Correlation of the displacements, from −1 to 1; null without motion.
    pub correlation: Option<f64>,
    /// Factor from the recorded displacement to the answered one.
    pub scale: Option<f64>,
    /// Median distance of answered and recorded action: m, rad, or closure.
    pub error: Option<f64>,
}

/// Agreement of a policy with demonstrations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolicyCheck {
    /// Number of demonstrations.
    pub demonstrations: usize,
    /// Number of answers.
    pub answers: usize,
    /// Median and largest time of an answer, s.
    pub answer_median_s: Option<f64>,
    /// Largest time of an answer, s.
    pub answer_max_s: Option<f64>,
    /// Translation of the tool.
    pub translation: AnswerAgreement,
    /// Rotation of the tool about the axes of the base.
    pub rotation: AnswerAgreement,
    /// Closure of the gripper.
    pub grip: AnswerAgreement,
    /// What is probably wrong, one sentence each; empty if the answers agree.
    pub findings: Vec<String>,
}

/// Compares the answers of `policy` with the first `count` demonstrations of a dataset, spread over its tasks.
///
/// # Errors
/// The dataset cannot be read or simulated, or the policy fails.
pub fn check_policy(
    policy: &PolicyConfig,
    dataset: &Path,
    count: usize,
    observer: &Arc<dyn Observer>,
) -> Result<PolicyCheck, RunError> {
    check_complete(dataset)?;
    let all = demos_of(dataset)?;
    if all.is_empty() {
        return Err(RunError::input(format!("{} has no demonstration", dataset.display())));
    }
    let count = count.clamp(1, all.len());
    let chosen: Vec<&DemoRef> = (0..count).map(|k| &all[k * all.len() / count]).collect();
    let connections = policy.connections();
    if let Some(connections) = &connections {
        connections.check().map_err(policy_failure)?;
    }
    let mut demos = Vec::with_capacity(count);
    for (k, demo) in chosen.iter().enumerate() {
        observer.work(&format!("comparing demonstration {} of {count}", k + 1));
        let samples = Arc::new(Mutex::new(DemoSamples::default()));
        let (policy, connections, shared) = (policy.clone(), connections.clone(), samples.clone());
        let controllers = |recorded: Vec<Action>| -> ControllerFactory {
            Box::new(move |opened, brief| {
                let started = policy.start(connections.as_ref(), &opened, &brief)?;
                let started = started.ok_or_else(|| RunError::input(NOT_COMPARABLE))?;
                let sampled = Box::new(SampledPolicy { policy: started, samples: shared.clone() });
                let replan = policy.replan.unwrap_or(usize::MAX);
                Ok(Box::new(ComparingController {
                    answers: ChunkedPolicy::new(sampled, brief, replan),
                    recorded: recorded.clone().into_iter(),
                    samples: shared.clone(),
                }))
            })
        };
        simulate_demo_with(demo, observer, controllers)?;
        observer.end();
        demos.push(std::mem::take(&mut *lock(&samples)));
    }
    Ok(PolicyCheck::new(&demos))
}

impl PolicyCheck {
    fn new(demos: &[DemoSamples]) -> Self {
        let steps: Vec<StepSample> = demos.iter().flat_map(|demo| &demo.steps).copied().collect();
        let steps = &steps[..];
        let mut seconds: Vec<f64> =
            demos.iter().flat_map(|demo| &demo.answers).map(|answer| answer.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        let translations =
            pairs(steps, LEAST_TRANSLATION_M, |s, action| action.position_b - s.tool_position_b);
        let rotations = pairs(steps, LEAST_ROTATION_RAD, turn);
        let grips: Vec<[f64; 2]> =
            steps.iter().map(|s| [s.recorded.closure(), s.answered.closure()]).collect();
        let (translation, rotation, grip) = (
            AnswerAgreement::of_vectors(&translations),
            AnswerAgreement::of_vectors(&rotations),
            AnswerAgreement::of_numbers(&grips),
        );
        let mut findings = Vec::new();
        match explain_joints(steps) {
            // The poses of such joint positions say nothing.
            Some(finding) => findings.push(finding),
            None => {
                findings.extend(explain_translation(&translations, &translation, steps));
                findings.extend(explain_rotation(&rotations, &rotation, steps));
            }
        }
        findings.extend(explain_grip(&grips, &grip));
        findings.extend(explain_rate(demos));
        Self {
            demonstrations: demos.len(),
            answers: seconds.len(),
            answer_median_s: quantile(&seconds, 0.5),
            answer_max_s: seconds.last().copied(),
            translation,
            rotation,
            grip,
            findings,
        }
    }

    /// The check as plain text.
    pub fn text(&self) -> String {
        let number = |value: Option<f64>, scale: f64, digits: usize| {
            value.map_or_else(|| "–".to_owned(), |value| format!("{:.digits$}", scale * value))
        };
        let row = |name: &str, of: &AnswerAgreement, scale: f64, unit: &str| {
            format!(
                "{name:<12}correlation {:>5}, factor {:>6}, median error {} {unit}\n",
                number(of.correlation, 1.0, 2),
                number(of.scale, 1.0, 2),
                number(of.error, scale, 2),
            )
        };
        let mut text = format!(
            "answers     {} in {}; {} ms in the median, {} ms at most\n",
            self.answers,
            counted(self.demonstrations, "demonstration"),
            number(self.answer_median_s, 1e3, 0),
            number(self.answer_max_s, 1e3, 0),
        );
        text += &row("translation", &self.translation, 1e3, "mm");
        text += &row("rotation", &self.rotation, 180.0 / std::f64::consts::PI, "°");
        text += &row("gripper", &self.grip, 1.0, "of the closure");
        if self.findings.is_empty() {
            text += "the answers agree with the demonstrations\n";
        }
        self.findings.iter().for_each(|finding| text += &format!("- {finding}\n"));
        text
    }
}

/// A recorded displacement and the answered one.
#[derive(Clone, Copy, Debug)]
struct VectorPair {
    recorded: Vec3,
    answered: Vec3,
}

/// Displacements of all steps in which the recorded one is at least `least`.
fn pairs(steps: &[StepSample], least: f64, of: impl Fn(&StepSample, &Action) -> Vec3) -> Vec<VectorPair> {
    let pair = |s: &StepSample| VectorPair { recorded: of(s, &s.recorded), answered: of(s, &s.answered) };
    steps.iter().map(pair).filter(|pair| pair.recorded.norm() >= least).collect()
}

/// Rotation vector from the measured orientation of the tool to that of an action, about the axes of the base.
fn turn(s: &StepSample, action: &Action) -> Vec3 {
    (rotation::from_axis_angle(&action.axis_angle_b) * s.tool_orientation_b.inverse()).scaled_axis()
}

impl AnswerAgreement {
    fn of_vectors(pairs: &[VectorPair]) -> Self {
        let (correlation, scale) = fit(pairs, &Mat3::identity());
        let mut errors: Vec<f64> = pairs.iter().map(|p| (p.answered - p.recorded).norm()).collect();
        errors.sort_by(f64::total_cmp);
        Self { n: pairs.len(), correlation, scale, error: quantile(&errors, 0.5) }
    }

    fn of_numbers(pairs: &[[f64; 2]]) -> Self {
        let mean = |side: usize| pairs.iter().map(|pair| pair[side]).sum::<f64>() / pairs.len().max(1) as f64;
        let means = [mean(0), mean(1)];
        let sum = |a: usize, b: usize| -> f64 {
            pairs.iter().map(|pair| (pair[a] - means[a]) * (pair[b] - means[b])).sum()
        };
        let (recorded, answered, both) = (sum(0, 0), sum(1, 1), sum(0, 1));
        let mut errors: Vec<f64> = pairs.iter().map(|pair| (pair[1] - pair[0]).abs()).collect();
        errors.sort_by(f64::total_cmp);
        Self {
            n: pairs.len(),
            correlation: (recorded * answered > 1e-12).then(|| both / (recorded * answered).sqrt()),
            scale: (recorded > 1e-9).then(|| both / recorded),
            error: quantile(&errors, 0.5),
        }
    }

    fn agrees(&self) -> bool {
        self.correlation.is_none_or(|r| r >= AGREES)
            && self.scale.is_none_or(|s| AGREEING_SCALES.contains(&s))
    }
}

/// Correlation and factor of the answers with the recorded displacements, turned by `axes`.
fn fit(pairs: &[VectorPair], axes: &Mat3) -> (Option<f64>, Option<f64>) {
    let sum = |of: &dyn Fn(&VectorPair) -> f64| -> f64 { pairs.iter().map(of).sum() };
    let recorded = sum(&|p| p.recorded.norm_squared());
    let answered = sum(&|p| p.answered.norm_squared());
    let both = sum(&|p| p.answered.dot(&(axes * p.recorded)));
    let correlation = (recorded > 0.0 && answered > 0.0).then(|| both / (recorded * answered).sqrt());
    (correlation, (recorded > 0.0).then(|| both / recorded))
}

/// All 48 ways in which axes can be exchanged and reversed.
fn signed_permutations() -> impl Iterator<Item = Mat3> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    ORDERS.into_iter().flat_map(|order| {
        (0..8).map(move |signs: usize| {
            Mat3::from_fn(|row, column| {
                let sign = if signs >> row & 1 == 1 { -1.0 } else { 1.0 };
                if order[row] == column { sign } else { 0.0 }
            })
        })
    })
}

/// The axes of which the answers would agree, if they explain the answers and those of the base do not.
fn other_axes(pairs: &[VectorPair], agreement: &AnswerAgreement) -> Option<String> {
    let own = agreement.correlation?;
    let of = |axes: &Mat3| fit(pairs, axes).0.unwrap_or(-1.0);
    let best = signed_permutations().max_by(|a, b| of(a).total_cmp(&of(b)))?;
    if own >= AGREES || of(&best) < EXPLAINS {
        return None;
    }
    let name = |row: usize| {
        let column = (0..3).find(|column| best[(row, *column)] != 0.0).unwrap_or(row);
        format!("{}{}", if best[(row, column)] < 0.0 { "−" } else { "" }, ["x", "y", "z"][column])
    };
    Some(format!("({}, {}, {})", name(0), name(1), name(2)))
}

/// Joint positions of answers that are outside of the limits of their joints.
fn explain_joints(steps: &[StepSample]) -> Option<String> {
    /// Joint positions beyond any limit, rad: half of the answers exceed it if they are in degrees.
    const DEGREES: f64 = 10.0;
    let answers: Vec<ArmAngles> = steps.iter().filter_map(|s| s.answered.joints).collect();
    let ranges = panda::joint_ranges();
    let outside = |joint: usize| answers.iter().filter(|q| !ranges[joint].contains(q[joint])).count();
    let joint = (0..ranges.len()).max_by_key(|joint| outside(*joint))?;
    if 2 * outside(joint) <= answers.len() {
        return None;
    }
    let mut largest: Vec<f64> =
        answers.iter().map(|q| q.iter().fold(0.0, |most: f64, x| most.max(x.abs()))).collect();
    largest.sort_by(f64::total_cmp);
    let unit = match quantile(&largest, 0.5) {
        Some(median) if median > DEGREES => ": radians are expected, these look like degrees",
        _ => ": check the order of the joints, and whether the normalisation was undone",
    };
    let JointRange { lower, upper } = ranges[joint];
    Some(format!(
        "joints: {} of {} answers have joint {} outside of its limits, {lower} to {upper} rad{unit}",
        outside(joint),
        answers.len(),
        joint + 1
    ))
}

fn explain_translation(pairs: &[VectorPair], of: &AnswerAgreement, steps: &[StepSample]) -> Option<String> {
    if of.agrees() {
        return None;
    }
    if let Some(offset) = constant_offset(steps) {
        return Some(format!(
            "translation: the answers are off by the constant ({:.3}, {:.3}, {:.3}) m: poses are expected in the frame of \
             the robot's base",
            offset.x, offset.y, offset.z
        ));
    }
    if let Some(axes) = other_axes(pairs, of) {
        return Some(format!("translation: (x, y, z) of the answers are {axes} of the demonstrations"));
    }
    let scale = of.scale?;
    Some(match of.correlation {
        Some(r) if r >= AGREES => format!(
            "translation: the answers are {scale:.3} times as long as the recorded ones: {}",
            match scale {
                400.0.. => "metres are expected, these look like millimetres",
                ..=0.0025 => "metres are expected, these look like kilometres or a normalisation that was not undone",
                _ => "check the scale of the profile's actions, and whether their normalisation was undone",
            }
        ),
        _ => "translation: the answers do not follow the demonstrations: check the images (order, flips, size), the \
              normalisation of the state, and that the policy was trained on this suite"
            .to_owned(),
    })
}

/// The mean distance of answered from recorded positions, if it explains nearly all of the difference.
fn constant_offset(steps: &[StepSample]) -> Option<Vec3> {
    let distance = |s: &StepSample| s.answered.position_b - s.recorded.position_b;
    let n = steps.len() as f64;
    let mean = steps.iter().map(distance).sum::<Vec3>() / n;
    let spread = (steps.iter().map(|s| (distance(s) - mean).norm_squared()).sum::<f64>() / n).sqrt();
    (mean.norm() > 0.02 && spread < 0.25 * mean.norm()).then_some(mean)
}

fn explain_rotation(pairs: &[VectorPair], of: &AnswerAgreement, steps: &[StepSample]) -> Option<String> {
    // A few turned steps say little.
    if of.agrees() || pairs.len() < 10 {
        return None;
    }
    let tool_pairs: Vec<VectorPair> = steps
        .iter()
        .map(|s| VectorPair {
            recorded: s.tool_orientation_b.inverse() * turn(s, &s.recorded),
            answered: turn(s, &s.answered),
        })
        .filter(|pair| pair.recorded.norm() >= LEAST_ROTATION_RAD)
        .collect();
    if fit(&tool_pairs, &Mat3::identity()).0.is_some_and(|r| r >= EXPLAINS)
        && of.correlation.is_some_and(|r| r < AGREES)
    {
        return Some(
            "rotation: the answers are turned about the axes of the tool; rotations are expected about those of the base"
                .to_owned(),
        );
    }
    if let Some(axes) = other_axes(pairs, of) {
        return Some(format!("rotation: (x, y, z) of the answers are {axes} of the demonstrations"));
    }
    let (r, scale) = (of.correlation?, of.scale?);
    Some(if r >= AGREES {
        let unit = if (30.0..=100.0).contains(&scale) {
            ": radians are expected, these look like degrees"
        } else {
            ""
        };
        format!("rotation: the answers are {scale:.3} times as large as the recorded ones{unit}")
    } else {
        "rotation: the answers do not follow the demonstrations: check its encoding (axis-angle, quaternion order, side)"
            .to_owned()
    })
}

fn explain_grip(pairs: &[[f64; 2]], of: &AnswerAgreement) -> Option<String> {
    let varies = |side: usize| {
        let values = pairs.iter().map(|pair| pair[side]);
        let [low, high] = values.fold([f64::MAX, f64::MIN], |[low, high], x| [low.min(x), high.max(x)]);
        high - low > 0.05
    };
    if !varies(0) {
        return None;
    }
    match of.correlation {
        _ if !varies(1) => Some("gripper: every answer commands the same closure".to_owned()),
        Some(r) if r <= -AGREES => Some(
            "gripper: the answers are inverted: they close where the demonstrations open; see the values of open and closed \
             in the profile"
                .to_owned(),
        ),
        Some(r) if r < AGREES => Some("gripper: the answers do not follow the demonstrations".to_owned()),
        _ => None,
    }
}

/// Compares the paths of answers with the demonstrations at half, the same and twice the speed.
fn explain_rate(demos: &[DemoSamples]) -> Option<String> {
    let error = |factor: f64| -> f64 {
        let of_answer = |demo: &DemoSamples, answer: &AnswerSample| -> f64 {
            let at = |j: usize| answer.step + ((j + 1) as f64 * factor).round() as usize - 1;
            let compared = answer
                .path_b
                .iter()
                .enumerate()
                .filter_map(|(j, p)| Some((p - demo.steps.get(at(j))?.recorded.position_b).norm()));
            compared.sum()
        };
        let of_demo = |demo: &DemoSamples| -> f64 {
            let long = demo.answers.iter().filter(|answer| answer.path_b.len() >= 4);
            long.map(|answer| of_answer(demo, answer)).sum()
        };
        demos.iter().map(of_demo).sum()
    };
    let [slow, same, fast] = [0.5, 1.0, 2.0].map(error);
    let (factor, least) = if slow < fast { ("half", slow) } else { ("twice", fast) };
    let rate = if slow < fast { "40 Hz" } else { "10 Hz" };
    (same > 0.0 && least < 0.5 * same).then(|| {
        format!(
            "rate: the answers move {factor} as far per action as the demonstrations: actions are executed at 20 Hz, these look \
             like {rate}"
        )
    })
}
