//! Summary of a run (`summary.json`): rates and distributions over its episodes.
//!
//! Rates are in percent over *all* episodes: an invalid episode, or one with missing evidence, counts as a failure. A
//! quantity that was judged in no episode has no rate. Distributions of D are over all episodes with a soft target:
//! means over the valid ones, percentiles with invalid ones ranked as worst.

use std::collections::BTreeMap;

use serde::Serialize;

pub use super::measures::{EpisodeDeformation, GroupScores};
use super::{
    measures::Episodes,
    record::{EpisodeRecord, UnreachableCommand},
};
use softvt_common::{episode_id::EpisodeIndex, text::counted};
use softvt_evaluation::{category::EpisodeCategory, statistics::Rate, verdict::Outcome};

/// Number of intervals of the κ curve between 0 and 1.
const KAPPA_STEPS: u32 = 20;

/// Smallest and largest τ of some episodes, %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TauRange {
    pub min: f64,
    pub max: f64,
}

impl TauRange {
    /// The range for the soft targets; `None` without any.
    pub(crate) fn new<'a>(records: impl Iterator<Item = &'a EpisodeRecord>) -> Option<Self> {
        let taus: Vec<f64> =
            records.flat_map(EpisodeRecord::soft_targets).filter_map(|target| target.tau).collect();
        let [min, max] = [f64::min, f64::max].map(|of| taus.iter().copied().reduce(of));
        min.zip(max).map(|(min, max)| Self { min, max })
    }
}

/// One point of the curve of safety over κ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RatesAtKappa {
    /// Share of D_ref that is allowed.
    pub kappa: f64,
    /// D_peak ≤ κ·D_ref.
    pub deformation_ok_rate: Rate,
    /// Safety Success at this κ.
    pub safety_success_rate: Rate,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskScores {
    pub task: usize,
    pub prompt: String,
    /// Asset of the target in the first episode.
    pub asset: String,
    #[serde(flatten)]
    pub scores: GroupScores,
}

/// Scores of the episodes with one target asset.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AssetScores {
    /// τ at the nominal κ, %.
    pub tau: Option<f64>,
    /// D_ref of the asset, %.
    pub d_ref: Option<f64>,
    #[serde(flatten)]
    pub scores: GroupScores,
}

/// Episode that its controller aborted or that is invalid, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailedEpisode {
    pub task: usize,
    pub episode: u32,
    pub reason: String,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RepeatedEpisode {
    pub task: usize,
    pub episode: u32,
    pub attempts: u32,
}

/// Commands of the policy that were not executed as given.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CommandCounts {
    pub steps: u64,
    /// Number of commands that were out of reach.
    pub far: u64,
    /// Number of episodes with such a command.
    pub far_episodes: usize,
    /// The first such command of the first of these episodes.
    pub first_far: Option<UnreachableCommand>,
    /// Number of grip values that were out of range, and clamped.
    pub clamped_grips: u64,
    /// Number of episodes with such a value.
    pub clamped_episodes: usize,
    /// Number of displacements that were out of range, and clamped.
    pub clamped_steps: u64,
    /// Number of episodes with such a displacement.
    pub clamped_step_episodes: usize,
}

impl CommandCounts {
    fn from_records(records: &[&EpisodeRecord]) -> Self {
        let stats = || records.iter().map(|r| &r.stats);
        Self {
            steps: stats().map(|s| u64::from(s.steps)).sum(),
            far: stats().map(|s| u64::from(s.far_commands)).sum(),
            far_episodes: stats().filter(|s| s.far_commands > 0).count(),
            first_far: stats().find_map(|s| s.first_far_command),
            clamped_grips: stats().map(|s| u64::from(s.clamped_grips)).sum(),
            clamped_episodes: stats().filter(|s| s.clamped_grips > 0).count(),
            clamped_steps: stats().map(|s| u64::from(s.clamped_steps)).sum(),
            clamped_step_episodes: stats().filter(|s| s.clamped_steps > 0).count(),
        }
    }
}

/// Contents of `summary.json`: one suite, one policy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SuiteSummary {
    pub suite: String,
    pub policy: String,
    /// True if the policy saw the true state in any episode, as experts do.
    pub privileged: bool,
    /// True if the actions of any episode are those of a recorded run.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub replayed: bool,
    /// True if the policy saw the true forces at the pads in any episode; no real sensor gives them.
    pub force_observed: bool,
    /// True if Safety Success needed NoSlip.
    pub no_slip_required: bool,
    pub commands: CommandCounts,
    /// Scores of all episodes together.
    #[serde(flatten)]
    pub scores: GroupScores,
    /// Safety over κ from 0 to 1; empty where no target deforms.
    pub kappa: Vec<RatesAtKappa>,
    /// Scores by task, in order.
    pub by_task: Vec<TaskScores>,
    pub by_asset: BTreeMap<String, AssetScores>,
    /// Episodes that the controller aborted, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gave_up: Vec<FailedEpisode>,
    /// Invalid episodes, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub invalid_episodes: Vec<FailedEpisode>,
    /// Episodes of more than one attempt, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub repeated_episodes: Vec<RepeatedEpisode>,
    /// Episodes whose goal was reached although the robot never touched a target, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub goals_untouched: Vec<EpisodeIndex>,
}

impl GroupScores {
    pub fn is_soft(&self) -> bool {
        self.deformation_ok_rate.is_some()
    }

    /// Rate by which policies are told apart: Safety Success, or Goal Success where that was not judged.
    pub fn main_rate(&self) -> Rate {
        let safety = self.safety_success_rate;
        if safety.rate.is_some() { safety } else { self.goal_success_rate }
    }

    pub fn count(&self, category: EpisodeCategory) -> usize {
        self.categories.get(&category).copied().unwrap_or(0)
    }

    pub fn from_records(records: &[&EpisodeRecord]) -> Self {
        Self::new(&Episodes { records, tasks: None })
    }
}

impl SuiteSummary {
    /// Summary of the episodes of one suite under one policy; records of other suites are left out. It does not
    /// depend on the order of `records`.
    pub fn from_records(suite: &str, policy: &str, records: &[EpisodeRecord]) -> Self {
        let mut records: Vec<_> = records.iter().filter(|r| r.header.id.suite == suite).collect();
        records.sort_by_key(|r| r.header.id.index());
        let task_scores = |(task, group): (usize, Vec<&EpisodeRecord>)| {
            let (prompt, asset) = (group[0].header.task_prompt().to_owned(), group[0].header.asset.clone());
            TaskScores { task, prompt, asset, scores: GroupScores::from_records(&group) }
        };
        let asset_scores = |(asset, group): (String, Vec<&EpisodeRecord>)| {
            let tau = group.iter().find_map(|r| r.verdict.object().tau);
            let d_ref = group.iter().find_map(|r| r.verdict.object().d_ref);
            (asset, AssetScores { tau, d_ref, scores: GroupScores::from_records(&group) })
        };
        let aborted = |r: &&EpisodeRecord| {
            let (task, episode) = (r.header.id.task, r.header.id.episode);
            r.stats.gave_up.clone().map(|reason| FailedEpisode { task, episode, reason })
        };
        let invalid = |r: &&EpisodeRecord| {
            let (task, episode) = (r.header.id.task, r.header.id.episode);
            let reason = match &r.outcome {
                Outcome::Invalid { reason, step, .. } => format!("{reason} at physics step {step}"),
                Outcome::Error { message } => message.clone(),
                Outcome::Completed | Outcome::Budget => return None,
            };
            Some(FailedEpisode { task, episode, reason })
        };
        let repeated = |r: &&EpisodeRecord| {
            let EpisodeIndex { task, episode } = r.header.id.index();
            r.stats.attempts.map(|attempts| RepeatedEpisode { task, episode, attempts })
        };
        let untouched = records.iter().filter(|r| r.verdict.goal_untouched);
        let by_task = grouped(&records, |r| r.header.id.task);
        let scores = GroupScores::new(&Episodes { records: &records, tasks: Some(&by_task) });
        Self {
            suite: suite.into(),
            policy: policy.into(),
            privileged: records.iter().any(|r| r.header.is_privileged()),
            replayed: records.iter().any(|r| r.header.replayed),
            force_observed: records.iter().any(|r| r.stats.force_observed),
            no_slip_required: records.iter().any(|r| r.verdict.slip_ok.is_some()),
            commands: CommandCounts::from_records(&records),
            scores,
            kappa: kappa_curve(&records),
            by_task: by_task.into_iter().map(task_scores).collect(),
            by_asset: grouped(&records, |r| r.header.asset.clone()).into_iter().map(asset_scores).collect(),
            gave_up: records.iter().filter_map(aborted).collect(),
            invalid_episodes: records.iter().filter_map(invalid).collect(),
            repeated_episodes: records.iter().filter_map(repeated).collect(),
            goals_untouched: untouched.map(|r| r.header.id.index()).collect(),
        }
    }

    /// Label of the method in tables, as [`method_label`].
    pub fn method_label(&self) -> String {
        method_label(&self.policy, self.marks())
    }

    /// Sentences on repeated attempts, and on goals that were reached without contact of the robot.
    pub fn attempt_notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let (repeated, untouched) = (&self.repeated_episodes, &self.goals_untouched);
        if let Some(most) = repeated.iter().max_by_key(|episode| episode.attempts) {
            let index = EpisodeIndex { task: most.task, episode: most.episode };
            notes.push(format!(
                "{} took more than one attempt (most: {index}, {}): the policy or the user broke off the others",
                counted(repeated.len(), "episode"),
                most.attempts
            ));
        }
        if let Some(first) = untouched.first() {
            notes.push(format!(
                "the goal was reached in {} without contact of the robot with a target (first: {first})",
                counted(untouched.len(), "episode")
            ));
        }
        notes
    }

    /// Marks of the method: knowledge beyond what a robot measures, and repeated actions.
    pub fn marks(&self) -> MethodMarks {
        let Self { privileged, replayed, force_observed, .. } = *self;
        MethodMarks { privileged, replayed, force_observed }
    }
}

/// Marks that tables add to the name of a policy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MethodMarks {
    /// It saw the true state.
    pub privileged: bool,
    /// It repeated the actions of a recorded run.
    pub replayed: bool,
    /// It saw the true pad forces.
    pub force_observed: bool,
}

/// Name of a policy with its marks: "expert (privileged)".
pub fn method_label(policy: &str, marks: MethodMarks) -> String {
    let MethodMarks { privileged, replayed, force_observed } = marks;
    let marks = [(privileged, "privileged"), (replayed, "replayed"), (force_observed, "force_observed")];
    let marks: Vec<&str> = marks.into_iter().filter_map(|(is, mark)| is.then_some(mark)).collect();
    if marks.is_empty() { policy.to_owned() } else { format!("{policy} ({})", marks.join(", ")) }
}

fn grouped<'a, K: Ord>(
    records: &[&'a EpisodeRecord],
    key: impl Fn(&EpisodeRecord) -> K,
) -> BTreeMap<K, Vec<&'a EpisodeRecord>> {
    let mut groups: BTreeMap<K, Vec<&EpisodeRecord>> = BTreeMap::new();
    records.iter().for_each(|record| groups.entry(key(record)).or_default().push(record));
    groups
}

/// Safety as a function of κ; everything but τ stays.
fn kappa_curve(records: &[&EpisodeRecord]) -> Vec<RatesAtKappa> {
    if !records.iter().any(|r| r.has_soft_target()) {
        return Vec::new();
    }
    let is_judged = records.iter().any(|r| r.has_judged_soft_target());
    let row = |step| {
        let kappa = f64::from(step) / f64::from(KAPPA_STEPS);
        if !is_judged {
            let none = Rate::not_judged();
            return RatesAtKappa { kappa, deformation_ok_rate: none, safety_success_rate: none };
        }
        RatesAtKappa {
            kappa,
            deformation_ok_rate: Rate::from_test(records, |r| r.is_within_at(kappa)),
            safety_success_rate: Rate::from_test(records, |r| r.is_safe_at(kappa)),
        }
    };
    (0..=KAPPA_STEPS).map(row).collect()
}

#[cfg(test)]
mod tests;
