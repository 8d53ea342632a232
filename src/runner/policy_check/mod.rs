//! Comparison of a policy's answers with the actions of demonstrations that it should know.
//!
//! The demonstrations are simulated again. At every request the policy sees the observation of a run, and its answer is
//! compared with the recorded action, which is executed. One affine map per channel is fitted by least squares: the
//! quantity of the demonstrations that the channel follows, with scale, offset, rate and lag. A scale of 1000, −1 or
//! 57.3, another source or a lag names what is wrong.

mod fit;
mod sampling;
mod series;
#[cfg(test)]
mod tests;

use std::{
    path::Path,
    sync::{Arc, Mutex},
};

use serde::Serialize;

use self::fit::channel_fits;
pub use self::{
    fit::ChannelFit,
    sampling::{AnswerComparison, DemoSamples, RecordedStep},
};
use crate::{
    error::RunError,
    observer::Observer,
    policy::{ControllerFactory, PolicyConfig},
    replay::{DemoRef, demos_of, simulate_demo_with},
    suite_run::policy_failure,
};
use softvt_common::{
    parallel::lock,
    table::{Column, Table},
    text::{counted, decimal, significant},
};
use softvt_dataset::TaskFile;
use softvt_evaluation::statistics::quantile;
use softvt_policy::Action;

const NOT_COMPARABLE: &str = "only policy servers and policies in Lua can be compared with demonstrations";

const LEGEND: &str = "\nanswer = scale · followed quantity + offset. Δ: from the observed pose. Rate: control steps per action. Lag: control\n\
                      steps by which the answers are late. Residual and motion of the demonstrations: root mean squares.\n";

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolicyCheck {
    pub demonstrations: usize,
    pub answers: usize,
    /// Median and largest time of an answer, s.
    pub answer_median_s: Option<f64>,
    /// Largest time of an answer, s.
    pub answer_max_s: Option<f64>,
    /// The error that ended the comparison, if there is one.
    pub failure: Option<String>,
    /// The fit of each channel of the answers.
    pub channels: Vec<ChannelFit>,
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
    let all = demos_of(dataset)?;
    if all.is_empty() {
        return Err(RunError::input(format_args!("{} has no demonstration", dataset.display())));
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
                let (encoding, steps, samples) = (encoding.clone(), steps.clone(), shared.clone());
                Ok(Box::new(AnswerComparison::new(started, brief, replan, encoding, steps, samples)))
            })
        };
        simulate_demo_with(demo, observer, controllers)?;
        observer.end();
        demos.push(std::mem::take(&mut *lock(&samples)));
    }
    Ok(PolicyCheck::of(&demos))
}

/// The actions of a demonstration, with the joint positions that they mean.
pub fn recorded_steps(demo: &DemoRef) -> Result<Vec<RecordedStep>, RunError> {
    let file = TaskFile::open(&demo.file)?;
    // Files of earlier versions have none.
    let joints = file.joint_commands(demo.demo).unwrap_or_default();
    let step = |(k, action)| RecordedStep { action, joints: joints.get(k).copied() };
    Ok(file.actions(demo.demo)?.into_iter().enumerate().map(step).collect())
}

impl PolicyCheck {
    pub fn of(demos: &[DemoSamples]) -> Self {
        let mut seconds: Vec<f64> = demos.iter().flat_map(|demo| &demo.answer_s).copied().collect();
        seconds.sort_by(f64::total_cmp);
        let failure = |(k, demo): (usize, &DemoSamples)| {
            let (failure, step) = (demo.failure.as_ref()?, demo.steps.len());
            Some(format!("demonstration {}, step {step}: {failure}", k + 1))
        };
        Self {
            demonstrations: demos.len(),
            answers: seconds.len(),
            answer_median_s: quantile(&seconds, 0.5),
            answer_max_s: seconds.last().copied(),
            failure: demos.iter().enumerate().find_map(failure),
            channels: channel_fits(demos),
        }
    }

    /// True if no parameter of any channel deviates.
    pub fn agrees(&self) -> bool {
        self.failure.is_none() && self.channels.iter().all(|fit| fit.deviates.is_empty())
    }

    /// The check as plain text: the table of the channels and its legend.
    pub fn text(&self) -> String {
        let seconds = |value: Option<f64>| decimal(value.map(|value| 1e3 * value), 0);
        let mut text = format!(
            "{} to {}; {} ms in the median, {} ms at most\n\n",
            counted(self.answers, "answer"),
            counted(self.demonstrations, "demonstration"),
            seconds(self.answer_median_s),
            seconds(self.answer_max_s),
        );
        let columns = [
            Column::text("answer", |fit: &ChannelFit| fit.channel.clone()),
            Column::text("follows", |fit: &ChannelFit| fit.source.clone()),
            Column::number("scale", |fit: &ChannelFit| {
                fit.scale.map_or_else(|| "–".to_owned(), |scale| rounded(scale, 1e4))
            }),
            Column::number("offset", |fit: &ChannelFit| fit.in_unit(fit.offset)),
            Column::number("rate", |fit: &ChannelFit| significant(fit.rate, 3)),
            Column::number("lag", |fit: &ChannelFit| fit.lag.to_string()),
            Column::number("residual", |fit: &ChannelFit| fit.in_unit(fit.residual)),
            Column::number("motion", |fit: &ChannelFit| fit.in_unit(fit.motion)),
            Column::text("deviates", |fit: &ChannelFit| fit.deviates.join(", ")),
        ];
        text += &Table::new(&self.channels, columns).text();
        text += LEGEND;
        if let Some(failure) = &self.failure {
            text += &format!("failed at {failure}\n");
        }
        if self.agrees() {
            text += "the answers agree with the demonstrations\n";
        }
        text
    }
}

impl ChannelFit {
    /// A number of the channel with three digits, in mm or degrees.
    fn in_unit(&self, x: f64) -> String {
        let (factor, unit) = match self.unit {
            "m" => (1e3, " mm"),
            "rad" => (180.0 / std::f64::consts::PI, "°"),
            _ => (1.0, ""),
        };
        format!("{}{unit}", rounded(factor * x, 1e3))
    }
}

/// A number with three digits, of which none is below 1 / `parts`; 0 has no sign.
fn rounded(x: f64, parts: f64) -> String {
    significant((parts * x).round() / parts + 0.0, 3)
}
