//! Comparison of a policy's answers with the actions of demonstrations that it should know.
//!
//! The demonstrations are simulated again. At every request the policy sees the observation of a run, and its answer is
//! compared with the recorded action, which is executed. Displacements count from the tool pose of the observation, or,
//! where the answers are displacements, from that at the time of execution. An answer that does not agree is read in
//! other ways (units, axes, frames, encodings, rates); one that leaves at most half of the error names the fault.

mod agreement;
mod grip;
mod joints;
mod position;
mod rotation;
mod sampling;
mod timing;

use std::{
    path::Path,
    sync::{Arc, Mutex},
};

use serde::Serialize;

pub use self::{
    agreement::AnswerAgreement,
    sampling::{AnswerComparison, DemoSamples, RecordedStep},
};
use self::{
    grip::{closures, explain_grip},
    joints::{are_joints, explain_joints},
    position::{PositionFinding, displacements, explain_position},
    rotation::{RotationFinding, explain_rotation, turns},
    sampling::StepSample,
    timing::{TimingFinding, explain_order, explain_timing, retimed},
};
use crate::{
    error::RunError,
    observer::Observer,
    policy::{ControllerFactory, PolicyConfig},
    replay::{DemoRef, check_complete, demos_of, simulate_demo_with},
    suite_run::policy_failure,
};
use softvt_common::{parallel::lock, text::counted};
use softvt_dataset::TaskFile;
use softvt_evaluation::statistics::quantile;
use softvt_policy::{Action, Observation, PolicyError, SensorStreams};
use softvt_rollout::{Controller, Simulation};

const NOT_COMPARABLE: &str = "only policy servers and policies in Lua can be compared with demonstrations";

/// Executes recorded actions in place of those that a policy answers.
struct ComparingController {
    comparison: AnswerComparison,
    recorded: std::vec::IntoIter<RecordedStep>,
}

impl Controller for ComparingController {
    fn streams(&self) -> SensorStreams {
        self.comparison.streams()
    }

    fn wants_observation(&self) -> bool {
        self.comparison.wants_observation()
    }

    fn act(&mut self, _sim: &Simulation, observation: &Observation) -> Result<Option<Action>, PolicyError> {
        let Some(recorded) = self.recorded.next() else { return Ok(None) };
        self.comparison.step(observation, recorded)?;
        Ok(Some(recorded.action))
    }

    fn finish(&mut self) -> Result<(), PolicyError> {
        self.comparison.finish()
    }
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
        let steps = recorded_steps(demo)?;
        let (policy, connections, shared) = (policy.clone(), connections.clone(), samples.clone());
        let encoding = policy.profile().map(|profile| profile.actions.clone());
        let controllers = |_: Vec<Action>| -> ControllerFactory {
            Box::new(move |opened, brief| {
                let started = policy.start(connections.as_ref(), &opened, &brief)?;
                let started = started.ok_or_else(|| RunError::input(NOT_COMPARABLE))?;
                let replan = policy.replan.unwrap_or(usize::MAX);
                Ok(Box::new(ComparingController {
                    comparison: AnswerComparison::new(
                        started,
                        brief,
                        replan,
                        encoding.clone(),
                        shared.clone(),
                    ),
                    recorded: steps.clone().into_iter(),
                }))
            })
        };
        simulate_demo_with(demo, observer, controllers)?;
        observer.end();
        demos.push(std::mem::take(&mut *lock(&samples)));
    }
    Ok(PolicyCheck::of(&demos))
}

/// The actions of a demonstration, with the joint positions that they mean.
///
/// # Errors
/// The file cannot be read.
pub fn recorded_steps(demo: &DemoRef) -> Result<Vec<RecordedStep>, RunError> {
    let file = TaskFile::open(&demo.file)?;
    // Files of earlier versions have none.
    let joints = file.joint_commands(demo.demo).unwrap_or_default();
    let step = |(k, action)| RecordedStep { action, joints: joints.get(k).copied() };
    Ok(file.actions(demo.demo)?.into_iter().enumerate().map(step).collect())
}

/// What is probably wrong: one sentence per cause.
fn findings(
    demos: &[DemoSamples],
    steps: &[StepSample],
    translation: &AnswerAgreement,
    rotation: &AnswerAgreement,
) -> Vec<String> {
    let failure = |(k, demo): (usize, &DemoSamples)| {
        let (failure, step) = (demo.failure.as_ref()?, demo.steps.len());
        Some(format!("answers: demonstration {}, step {step}: {failure}", k + 1))
    };
    let mut findings: Vec<String> = demos.iter().enumerate().find_map(failure).into_iter().collect();
    if steps.is_empty() {
        return findings;
    }
    let mut has_taken_grip = false;
    let timing = explain_timing(demos);
    let stretch = timing.as_ref().and_then(|timing| timing.stretch);
    let timed = stretch.map(|stretch| retimed(demos, stretch));
    match timing {
        // The orientations of the same steps.
        Some(TimingFinding { text, stretch }) => {
            findings.push(text);
            let timed = timed
                .as_deref()
                .filter(|timed| stretch.is_some() && !are_joints(timed) && !timed.iter().any(|s| s.is_step));
            if let Some(found) =
                timed.and_then(|timed| explain_rotation(timed, &AnswerAgreement::of_vectors(&turns(timed))))
            {
                has_taken_grip = found.has_taken_grip;
                findings.push(found.text);
            }
        }
        None if are_joints(steps) => findings.extend(explain_joints(steps, translation)),
        None if let Some(reversed) = explain_order(steps) => findings.push(reversed),
        None => {
            let position = explain_position(steps, translation);
            let is_other = position.as_ref().is_some_and(|found| found.is_other_encoding);
            let rotation = if is_other { None } else { explain_rotation(steps, rotation) };
            has_taken_grip = rotation.as_ref().is_some_and(|found| found.has_taken_grip);
            findings.extend(pose_findings(position, rotation));
        }
    }
    if !has_taken_grip {
        let pairs = closures(timed.as_deref().unwrap_or(steps));
        let values = demos.first().and_then(|demo| demo.encoding.as_ref()).map(|encoding| encoding.gripper);
        findings.extend(explain_grip(&pairs, &AnswerAgreement::of_numbers(&pairs), values));
    }
    findings
}

/// The findings about positions and orientations: one, if both are in the same turned frame.
fn pose_findings(position: Option<PositionFinding>, rotation: Option<RotationFinding>) -> Vec<String> {
    /// Difference of matrices that are the same turn.
    const SAME: f64 = 0.2;
    let turns = position.as_ref().and_then(|found| found.frame_turn);
    let turns = turns.zip(rotation.as_ref().and_then(|found| found.frame_turn));
    let is_one = turns.is_some_and(|(position, rotation)| (position - rotation).norm() < SAME);
    let rotation = rotation.filter(|_| !is_one);
    position.map(|found| found.text).into_iter().chain(rotation.map(|found| found.text)).collect()
}

impl PolicyCheck {
    /// Compares what was seen in demonstrations.
    pub fn of(demos: &[DemoSamples]) -> Self {
        let steps: Vec<StepSample> = demos.iter().flat_map(|demo| &demo.steps).cloned().collect();
        let mut seconds: Vec<f64> =
            demos.iter().flat_map(|demo| &demo.answers).map(|answer| answer.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        let translation = AnswerAgreement::of_vectors(&displacements(&steps));
        let rotation = AnswerAgreement::of_vectors(&turns(&steps));
        let grip = AnswerAgreement::of_numbers(&closures(&steps));
        Self {
            demonstrations: demos.len(),
            answers: seconds.len(),
            answer_median_s: quantile(&seconds, 0.5),
            answer_max_s: seconds.last().copied(),
            translation,
            rotation,
            grip,
            findings: findings(demos, &steps, &translation, &rotation),
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
