//! Summary of a run (`summary.json`): rates and distributions over its episodes.
//!
//! Rates are in percent over *all* episodes: an invalid episode, or one with missing evidence, counts as a failure.
//! Distributions of D are over the valid episodes with a measured D.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    record::EpisodeRecord,
    safety::{DeformationLimit, PeakDeformation, is_safe},
    statistics::{Distribution, Rate},
};

/// Number of intervals of the κ curve between 0 and 1.
const KAPPA_STEPS: u32 = 20;

/// Success rates and deformation of a group of episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Number of episodes, valid or not.
    pub episodes: usize,
    /// Number of episodes that were invalid or could not be run.
    pub invalid: usize,
    /// Number of valid episodes whose safety could not be judged, for lack of a threshold or of evidence.
    pub safety_unknown: usize,
    /// Rate of Goal Success over all episodes.
    pub goal_success_rate: Rate,
    /// Rate of NoDrop over all episodes.
    pub no_drop_rate: Rate,
    /// D_peak ≤ τ; null where no target deforms.
    pub deformation_ok_rate: Option<Rate>,
    /// Rate of Safety Success over all episodes.
    pub safety_success_rate: Rate,
    /// Goal Success minus Safety Success, percentage points.
    pub goal_safe_gap: Option<f64>,
    /// NoSlip; reported only.
    pub no_slip_rate: Rate,
    /// Goal Success by the looser predicate of SoftVTBench's released code.
    pub goal_v1_rate: Rate,
    /// Share of episodes in which another object was lifted first.
    pub wrong_instance_rate: Rate,
    /// Peak D of all valid episodes, %.
    pub deformation: Distribution,
    /// Peak D of the valid episodes that reached the goal, %.
    pub deformation_goal: Distribution,
}

/// One point of the curve of safety over κ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KappaRow {
    /// Share of D_ref that is allowed.
    pub kappa: f64,
    /// D_peak ≤ κ·D_ref.
    pub deformation_ok_rate: Rate,
    /// Safety Success at this κ.
    pub safety_success_rate: Rate,
}

/// Scores of one task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskScores {
    /// Index of the task in the suite.
    pub task: usize,
    /// Instruction given to the policy.
    pub prompt: String,
    /// Asset of the target in the first episode.
    pub asset: String,
    /// Scores of its episodes.
    #[serde(flatten)]
    pub scores: Scores,
}

/// Scores of the episodes with one target asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssetScores {
    /// τ at the nominal κ, %.
    pub tau: Option<f64>,
    /// D_ref of the asset, %.
    pub d_ref: Option<f64>,
    /// Scores of its episodes.
    #[serde(flatten)]
    pub scores: Scores,
}

/// Episode that its controller aborted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AbortedEpisode {
    /// Index of the task.
    pub task: usize,
    /// Index of the episode in the task.
    pub episode: u32,
    /// Reason given by the controller.
    pub reason: String,
}

/// Contents of `summary.json`: one suite, one policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SuiteSummary {
    /// Name of the suite.
    pub suite: String,
    /// Name of the policy.
    pub policy: String,
    /// True if the policy saw the true state in any episode, as experts do.
    #[serde(default)]
    pub privileged: bool,
    /// True if the policy saw the true forces at the pads in any episode; no real sensor gives them.
    #[serde(default)]
    pub force_observed: bool,
    /// Scores of all episodes together.
    #[serde(flatten)]
    pub scores: Scores,
    /// Safety over κ from 0 to 1; empty where no target deforms.
    pub kappa: Vec<KappaRow>,
    /// Scores by task, in order.
    pub by_task: Vec<TaskScores>,
    /// Scores by asset of the target.
    pub by_asset: BTreeMap<String, AssetScores>,
    /// Episodes that the controller aborted, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gave_up: Vec<AbortedEpisode>,
}

impl Scores {
    /// Scores of `records`.
    pub fn from_records(records: &[&EpisodeRecord]) -> Self {
        let valid: Vec<_> = records.iter().copied().filter(|r| r.outcome.is_valid()).collect();
        let rate = |test: fn(&EpisodeRecord) -> bool| {
            Rate::new(valid.iter().filter(|r| test(r)).count(), records.len())
        };
        let soft = records.iter().any(|r| r.header.soft);
        let (goal, safety) = (rate(|r| r.verdict.goal), rate(|r| r.verdict.safety));
        let peaks = |reached: fn(&EpisodeRecord) -> bool| {
            Distribution::from_values(
                valid.iter().filter(|r| reached(r)).filter_map(|r| r.verdict.d_peak).collect(),
            )
        };
        Self {
            episodes: records.len(),
            invalid: records.len() - valid.len(),
            safety_unknown: valid.iter().filter(|r| !r.verdict.safety_known).count(),
            goal_success_rate: goal,
            no_drop_rate: rate(|r| r.verdict.no_drop),
            deformation_ok_rate: soft.then(|| rate(|r| r.verdict.deformation_ok == Some(true))),
            safety_success_rate: safety,
            goal_safe_gap: goal.rate.zip(safety.rate).map(|(goal, safety)| goal - safety),
            no_slip_rate: rate(|r| r.verdict.no_slip),
            goal_v1_rate: rate(|r| r.verdict.goal_v1),
            wrong_instance_rate: rate(|r| r.verdict.wrong_instance),
            deformation: peaks(|_| true),
            deformation_goal: peaks(|r| r.verdict.goal),
        }
    }
}

impl SuiteSummary {
    /// Summary of the episodes of one suite under one policy; records of other suites are left out. It does not
    /// depend on the order of `records`.
    pub fn from_records(suite: &str, policy: &str, records: &[EpisodeRecord]) -> Self {
        let mut records: Vec<_> = records.iter().filter(|r| r.header.id.suite == suite).collect();
        records.sort_by_key(|r| r.header.id.index());
        let task_scores = |(task, group): (usize, Vec<&EpisodeRecord>)| {
            let (prompt, asset) = (group[0].header.prompt.clone(), group[0].header.asset.clone());
            TaskScores { task, prompt, asset, scores: Scores::from_records(&group) }
        };
        let asset_scores = |(asset, group): (String, Vec<&EpisodeRecord>)| {
            let tau = group.iter().find_map(|r| r.verdict.tau);
            let d_ref = group.iter().find_map(|r| r.verdict.d_ref);
            (asset, AssetScores { tau, d_ref, scores: Scores::from_records(&group) })
        };
        let aborted = |r: &&EpisodeRecord| {
            let (task, episode) = (r.header.id.task, r.header.id.episode);
            r.stats.gave_up.clone().map(|reason| AbortedEpisode { task, episode, reason })
        };
        Self {
            suite: suite.into(),
            policy: policy.into(),
            privileged: records.iter().any(|r| r.header.privileged),
            force_observed: records.iter().any(|r| r.stats.force_observed),
            scores: Scores::from_records(&records),
            kappa: kappa_curve(&records),
            by_task: grouped(&records, |r| r.header.id.task).into_iter().map(task_scores).collect(),
            by_asset: grouped(&records, |r| r.header.asset.clone()).into_iter().map(asset_scores).collect(),
            gave_up: records.iter().filter_map(aborted).collect(),
        }
    }

    /// Label of the method in tables, as [`method_label`].
    pub fn method_label(&self) -> String {
        method_label(&self.policy, self.privileged, self.force_observed)
    }
}

/// Name of a policy, marked if it saw the true state ("privileged") or the true pad forces ("force_observed").
pub fn method_label(policy: &str, privileged: bool, force_observed: bool) -> String {
    let marks = [(privileged, "privileged"), (force_observed, "force_observed")];
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
fn kappa_curve(records: &[&EpisodeRecord]) -> Vec<KappaRow> {
    if !records.iter().any(|r| r.header.soft) {
        return Vec::new();
    }
    let row = |step| {
        let kappa = f64::from(step) / f64::from(KAPPA_STEPS);
        KappaRow {
            kappa,
            deformation_ok_rate: Rate::from_test(records, |r| is_within(r, kappa) == Some(true)),
            safety_success_rate: Rate::from_test(records, |r| {
                let v = &r.verdict;
                is_safe(v.goal, v.no_drop, r.header.soft, is_within(r, kappa))
            }),
        }
    };
    (0..=KAPPA_STEPS).map(row).collect()
}

/// True if D_peak ≤ κ·D_ref; `None` if that is unknown.
fn is_within(record: &EpisodeRecord, kappa: f64) -> Option<bool> {
    let verdict = &record.verdict;
    let limit = verdict.d_ref.map(|d_ref_pct| DeformationLimit { d_ref_pct, kappa });
    let peak = PeakDeformation { d_pct: verdict.d_peak, missing: verdict.missing_deformation };
    peak.is_within(limit.map(|l| l.tau_pct())).filter(|_| record.outcome.is_valid())
}

#[cfg(test)]
mod tests;
