//! What a run says: rates and distributions over its episodes (`summary.json`). Rates are in percent over *all*
//! episodes: an invalid one, or one whose evidence is missing, succeeded at nothing and is counted.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    record::EpisodeRecord,
    safety::{Limit, Peak, safe},
    statistics::{Distribution, Rate},
};

/// Steps of the κ curve in 0..=1.
const KAPPA_STEPS: u32 = 20;

/// Rates and deformation of a group of episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Episodes.
    pub episodes: usize,
    /// Episodes that were invalid or could not be run.
    pub invalid: usize,
    /// Valid episodes whose safety could not be judged: a missing threshold or missing evidence.
    pub safety_unknown: usize,
    /// Goal Success.
    pub goal_success_rate: Rate,
    /// NoDrop.
    pub no_drop_rate: Rate,
    /// D_peak ≤ τ; null where no target deforms.
    pub deformation_ok_rate: Option<Rate>,
    /// Safety Success.
    pub safety_success_rate: Rate,
    /// Goal Success minus Safety Success, percentage points.
    pub goal_safe_gap: Option<f64>,
    /// Episodes without slip; reported only.
    pub no_slip_rate: Rate,
    /// The released code's looser Goal Success.
    pub goal_v1_rate: Rate,
    /// Episodes in which another object was lifted first.
    pub wrong_instance_rate: Rate,
    /// Peak D over all valid episodes, %.
    pub deformation: Distribution,
    /// Peak D over those that reached the goal, %.
    pub deformation_goal: Distribution,
}

/// One κ of the sensitivity curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KappaRow {
    /// κ.
    pub kappa: f64,
    /// D_peak ≤ κ·D_ref.
    pub deformation_ok_rate: Rate,
    /// Safety Success at this κ.
    pub safety_success_rate: Rate,
}

/// The scores of one task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskScores {
    /// Index in the suite.
    pub task: usize,
    /// What the policy was told.
    pub prompt: String,
    /// Asset of the target, of the first episode.
    pub asset: String,
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
}

/// The scores of one asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssetScores {
    /// Nominal τ, %.
    pub tau: Option<f64>,
    /// D_ref, %.
    pub d_ref: Option<f64>,
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
}

/// An episode in which whoever drove gave up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GivenUp {
    /// Index of the task.
    pub task: usize,
    /// Index of the episode in the task.
    pub episode: u32,
    /// Why.
    pub reason: String,
}

/// `summary.json`: one suite, one policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Suite name.
    pub suite: String,
    /// Policy name.
    pub policy: String,
    /// Whether the policy saw the true state in any episode, as experts do.
    #[serde(default)]
    pub privileged: bool,
    /// Whether the policy saw the true forces at the pads in any episode; no real sensor gives them.
    #[serde(default)]
    pub force_observed: bool,
    /// All episodes together.
    #[serde(flatten)]
    pub scores: Scores,
    /// Safety over κ in 0..=1; empty where no target deforms.
    pub kappa: Vec<KappaRow>,
    /// By task, in order.
    pub by_task: Vec<TaskScores>,
    /// By asset of the target.
    pub by_asset: BTreeMap<String, AssetScores>,
    /// The episodes in which whoever drove gave up, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gave_up: Vec<GivenUp>,
}

impl Scores {
    /// The scores of `records`.
    pub fn of(records: &[&EpisodeRecord]) -> Self {
        let valid: Vec<_> = records.iter().copied().filter(|r| r.outcome.is_valid()).collect();
        let rate = |test: fn(&EpisodeRecord) -> bool| {
            Rate::new(valid.iter().filter(|r| test(r)).count(), records.len())
        };
        let soft = records.iter().any(|r| r.identity.soft);
        let (goal, safety) = (rate(|r| r.verdict.goal), rate(|r| r.verdict.safety));
        let peaks = |reached: fn(&EpisodeRecord) -> bool| {
            Distribution::of(valid.iter().filter(|r| reached(r)).filter_map(|r| r.verdict.d_peak).collect())
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

impl Summary {
    /// The summary of one suite's episodes under one policy; those of other suites are left out. It does not depend on
    /// the order of `records`.
    pub fn of(suite: &str, policy: &str, records: &[EpisodeRecord]) -> Self {
        let mut records: Vec<_> = records.iter().filter(|r| r.identity.suite == suite).collect();
        records.sort_by_key(|r| (r.identity.task, r.identity.episode));
        let tasks = grouped(&records, |r| r.identity.task);
        let assets = grouped(&records, |r| r.identity.asset.clone());
        Self {
            suite: suite.into(),
            policy: policy.into(),
            privileged: records.iter().any(|r| r.identity.privileged),
            force_observed: records.iter().any(|r| r.stats.force_observed),
            scores: Scores::of(&records),
            kappa: kappa_curve(&records),
            by_task: tasks.into_iter().map(|(task, group)| task_scores(task, &group)).collect(),
            by_asset: assets.into_iter().map(|(asset, group)| (asset, asset_scores(&group))).collect(),
            gave_up: records.iter().filter_map(|record| given_up(record)).collect(),
        }
    }
}

impl Summary {
    /// The policy, and what it has that no robot has: as every table names it.
    pub fn method(&self) -> String {
        method(&self.policy, self.privileged, self.force_observed)
    }
}

/// A policy's name with what it has that no robot has.
pub fn method(policy: &str, privileged: bool, force_observed: bool) -> String {
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

fn given_up(record: &EpisodeRecord) -> Option<GivenUp> {
    let reason = record.stats.gave_up.clone()?;
    Some(GivenUp { task: record.identity.task, episode: record.identity.episode, reason })
}

fn task_scores(task: usize, group: &[&EpisodeRecord]) -> TaskScores {
    let first = &group[0].identity;
    TaskScores { task, prompt: first.prompt.clone(), asset: first.asset.clone(), scores: Scores::of(group) }
}

fn asset_scores(group: &[&EpisodeRecord]) -> AssetScores {
    AssetScores {
        tau: group.iter().find_map(|r| r.verdict.tau),
        d_ref: group.iter().find_map(|r| r.verdict.d_ref),
        scores: Scores::of(group),
    }
}

/// Safety as a function of κ; only τ changes.
fn kappa_curve(records: &[&EpisodeRecord]) -> Vec<KappaRow> {
    if !records.iter().any(|r| r.identity.soft) {
        return Vec::new();
    }
    (0..=KAPPA_STEPS)
        .map(|step| {
            let kappa = f64::from(step) / f64::from(KAPPA_STEPS);
            KappaRow {
                kappa,
                deformation_ok_rate: Rate::of(records, |r| within(r, kappa) == Some(true)),
                safety_success_rate: Rate::of(records, |r| {
                    let v = &r.verdict;
                    safe(v.goal, v.no_drop, r.identity.soft, within(r, kappa))
                }),
            }
        })
        .collect()
}

fn within(record: &EpisodeRecord, kappa: f64) -> Option<bool> {
    let verdict = &record.verdict;
    let limit = verdict.d_ref.map(|d_ref_pct| Limit { d_ref_pct, kappa });
    let peak = Peak { d_pct: verdict.d_peak, missing: verdict.missing_deformation };
    if record.outcome.is_valid() { peak.within(limit.map(|l| l.tau_pct())) } else { None }
}

#[cfg(test)]
#[path = "summary_tests.rs"]
mod tests;
