//! Paired statistics: the same episodes in two runs, compared one by one.
//!
//! The runs are of two policies, or of a condition and its reference. Pairs share suite, task, initial state and
//! seed, so that nothing else differs between them. Rates are compared by McNemar's exact test with the interval of
//! Agresti and Min; deformations by the bootstrap of the mean difference.

use std::collections::BTreeMap;

use serde::Serialize;

pub use super::measures::PairedComparison;
use super::{
    paired_tests::{e_value, mcnemar, signed_rank},
    record::EpisodeRecord,
};
use softvt_common::episode_id::EpisodeId;
use softvt_evaluation::{
    stage::TaskStage,
    statistics::{Z95, mean, stratified_bootstrap},
};

#[derive(Clone, Copy, Debug)]
pub struct EpisodePair<'a> {
    /// The episode in the first run (the reference of a condition).
    pub first: &'a EpisodeRecord,
    pub second: &'a EpisodeRecord,
}

/// Pairs the episodes of two runs. In addition to the id it has the layout: two versions of a suite
/// may give a task another layout, so that initial states of the same id differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EpisodeKey<'a> {
    pub id: &'a EpisodeId,
    pub layout: &'a str,
}

impl<'a> EpisodeKey<'a> {
    pub fn new(record: &'a EpisodeRecord) -> Self {
        Self { id: &record.header.id, layout: &record.header.layout }
    }
}

/// Pairs of the episodes that both runs have, in the order of their keys, whatever the order of the records. Episodes
/// that only one run has are left out. An episode must not occur twice in a run.
pub fn pair_episodes<'a>(
    first: impl IntoIterator<Item = &'a EpisodeRecord>,
    second: impl IntoIterator<Item = &'a EpisodeRecord>,
) -> Vec<EpisodePair<'a>> {
    let second: BTreeMap<_, _> = second.into_iter().map(|record| (EpisodeKey::new(record), record)).collect();
    let pairs = first.into_iter().filter_map(|first| {
        let key = EpisodeKey::new(first);
        Some((key, EpisodePair { first, second: second.get(&key)? }))
    });
    BTreeMap::from_iter(pairs).into_values().collect()
}

/// Splits pairs, in the order of [`pair_episodes`], by task.
pub fn group_by_task<'p, 'a>(pairs: &'p [EpisodePair<'a>]) -> impl Iterator<Item = &'p [EpisodePair<'a>]> {
    pairs.chunk_by(|a, b| {
        let (a, b) = (&a.first.header.id, &b.first.header.id);
        a.suite == b.suite && a.task == b.task
    })
}

/// Stages at which the same episodes of two runs failed.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PairedStages {
    /// Number of episodes in which both runs recorded stages.
    pub n: usize,
    /// Number of failed episodes of the first run, by stage.
    pub first: BTreeMap<TaskStage, usize>,
    /// Number of failed episodes of the second run, by stage.
    pub second: BTreeMap<TaskStage, usize>,
    /// Number of episodes in which the second run completed more stages.
    pub better: usize,
    /// Number of episodes in which the first run completed more stages.
    pub worse: usize,
}

impl PairedStages {
    /// Compares the stage of failure of each episode in the first and in the second run, `None` after Goal Success.
    pub fn new(pairs: impl IntoIterator<Item = [Option<TaskStage>; 2]>) -> Self {
        let mut stages = Self::default();
        // Stages are in order, and Goal Success comes after all of them.
        let completed =
            |failed: Option<TaskStage>| failed.map_or(TaskStage::ALL.len(), |stage| stage as usize);
        for [first, second] in pairs {
            stages.n += 1;
            for (counts, failed) in [(&mut stages.first, first), (&mut stages.second, second)] {
                if let Some(stage) = failed {
                    *counts.entry(stage).or_insert(0) += 1;
                }
            }
            stages.better += usize::from(completed(second) > completed(first));
            stages.worse += usize::from(completed(second) < completed(first));
        }
        stages
    }
}

/// Difference of a rate (%) or of the mean of a lower-is-better quantity over the same episodes of two runs.
///
/// # Example
///
/// Of 100 episodes, 4 succeed in the first run only, 12 in the second only and 50 in both.
///
/// ```
/// use softvt_runs::paired_stats::PairedDifference;
///
/// let pairs = (0..100).map(|i| [i < 4 || i >= 50, i >= 4 && i < 16 || i >= 50]);
/// let safety = PairedDifference::from_successes(pairs);
/// assert_eq!((safety.first, safety.second), (Some(54.0), Some(62.0)));
/// assert_eq!((safety.better, safety.worse, safety.same), (12, 4, 84));
/// let [low, high] = safety.interval95.expect("episodes");
/// assert!(low > 0.0 && high < 16.0 && safety.p.is_some_and(|p| p < 0.08));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PairedDifference {
    /// Number of episodes in which both runs have the quantity.
    pub n: usize,
    /// Rate (%) or mean of the first run; null without episodes.
    pub first: Option<f64>,
    /// Rate (%) or mean of the second run.
    pub second: Option<f64>,
    /// Number of episodes in which the second run alone succeeds, the first alone fails, or the second has less.
    pub better: usize,
    /// Number of episodes in which the first run alone succeeds, the second alone fails, or the first has less.
    pub worse: usize,
    /// Number of the other episodes.
    pub same: usize,
    /// Second minus first; percentage points for a rate, null without episodes.
    pub difference: Option<f64>,
    /// 95 % interval of the difference: of a rate by Agresti & Min (2005); of a mean by the percentile bootstrap over
    /// episodes (Efron, 1979), from a fixed seed, null for fewer than
    /// [`MIN_BOOTSTRAP_VALUES`](softvt_evaluation::statistics::MIN_BOOTSTRAP_VALUES) episodes.
    pub interval95: Option<[f64; 2]>,
    /// Two-sided p-value: of McNemar's exact test for a rate, of Wilcoxon's signed-rank test for a mean (null if no
    /// episode differs). It is valid for a number of episodes that was chosen before the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
    /// E-value of a rate ([`e_value`]), valid at any time of the run; absent for a mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub e: Option<f64>,
}

impl PairedDifference {
    /// Compares the success of each episode in the first and in the second run.
    pub fn from_successes(pairs: impl IntoIterator<Item = [bool; 2]>) -> Self {
        let (mut n, mut in_first, mut better, mut worse) = (0, 0, 0, 0);
        for [first, second] in pairs {
            n += 1;
            in_first += usize::from(first);
            better += usize::from(second && !first);
            worse += usize::from(first && !second);
        }
        let points = |share: f64| (100.0 * share).clamp(-100.0, 100.0);
        let percent = |count: usize| (n > 0).then(|| points(count as f64 / n as f64));
        Self {
            n,
            first: percent(in_first),
            second: percent(in_first + better - worse),
            better,
            worse,
            same: n - better - worse,
            difference: (n > 0).then(|| points((better as f64 - worse as f64) / n as f64)),
            interval95: (n > 0).then(|| agresti_min(n, better, worse).map(points)),
            p: Some(mcnemar(better, worse)),
            e: Some(e_value(better, worse)),
        }
    }

    /// Compares a failure, whose rate should be low, of each episode in the first and in the second run.
    pub fn from_failures(pairs: impl IntoIterator<Item = [bool; 2]>) -> Self {
        let rates = Self::from_successes(pairs);
        Self { better: rates.worse, worse: rates.better, ..rates }
    }

    /// Compares a lower-is-better quantity of each episode in the first and in the second run.
    pub fn from_values(pairs: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let (first, second): (Vec<f64>, Vec<f64>) = pairs.into_iter().map(Into::into).unzip();
        let differences: Vec<f64> = first.iter().zip(&second).map(|(first, second)| second - first).collect();
        let better = differences.iter().filter(|d| **d < 0.0).count();
        let worse = differences.iter().filter(|d| **d > 0.0).count();
        Self {
            n: differences.len(),
            first: mean(&first),
            second: mean(&second),
            better,
            worse,
            same: differences.len() - better - worse,
            difference: mean(&differences),
            interval95: stratified_bootstrap(std::slice::from_ref(&differences)),
            p: signed_rank(&differences),
            e: None,
        }
    }
}

/// 95 % interval of a difference of matched proportions (Agresti & Min, Statistics in Medicine 24, 2005): Wald's
/// interval with half an episode added to each cell of the 2 × 2 table.
fn agresti_min(n: usize, better: usize, worse: usize) -> [f64; 2] {
    let (n, b, c) = (n as f64 + 2.0, better as f64 + 0.5, worse as f64 + 0.5);
    let centre = (b - c) / n;
    let half = Z95 * ((b + c) - (b - c) * (b - c) / n).sqrt() / n;
    [centre - half, centre + half]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::tests::sample;
    use softvt_evaluation::verdict::{InvalidReason, Outcome, TargetVerdict, WrongObjectContact};

    /// Goal, safety and D of each episode; τ is 1.
    fn run(episodes: &[(bool, bool, f64)]) -> Vec<EpisodeRecord> {
        let record = |(i, &(goal, safety, d)): (usize, &(bool, bool, f64))| {
            let mut record = sample();
            record.header.id.episode = i as u32;
            (record.verdict.goal, record.verdict.safety, record.verdict.object_mut().d_peak) =
                (goal, safety, Some(d));
            record
        };
        episodes.iter().enumerate().map(record).collect()
    }

    fn counts(of: PairedDifference) -> [usize; 3] {
        [of.better, of.worse, of.same]
    }

    #[test]
    fn pairs_are_compared_one_by_one_whatever_their_order() {
        let before = run(&[(true, true, 0.5), (true, false, 1.5), (false, false, 0.2), (true, true, 0.4)]);
        let mut after =
            run(&[(true, false, 1.25), (true, true, 0.75), (false, false, 0.2), (false, false, 0.4)]);
        after.reverse();
        let paired = PairedComparison::from_pairs(&pair_episodes(&before, &after));
        assert_eq!((paired.pairs, counts(paired.goal), counts(paired.safety)), (4, [0, 1, 3], [1, 2, 1]));
        let d = paired.d_over_tau;
        assert_eq!((d.better, d.worse, d.same, d.difference), (1, 1, 2, Some(0.0)));
        assert_eq!(paired.d_peak, d, "τ is 1");
    }

    #[test]
    fn an_invalid_episode_is_worse_and_has_no_deformation_and_unpaired_episodes_are_left_out() {
        let before = run(&[(true, true, 0.5), (true, true, 0.5)]);
        let mut after = run(&[(true, true, 0.6), (true, true, 0.6), (true, true, 0.6)]);
        after[1].outcome = Outcome::Invalid { reason: InvalidReason::Inverted, step: 3, node: None };
        let paired = PairedComparison::from_pairs(&pair_episodes(&before, &after));
        assert_eq!((paired.pairs, counts(paired.goal), counts(paired.no_drop)), (2, [0, 1, 1], [0, 1, 1]));
        assert_eq!((paired.d_over_tau.n, paired.d_over_tau.worse), (1, 1));
        after[0].verdict.object_mut().tau = None;
        let paired = PairedComparison::from_pairs(&pair_episodes(&before, &after));
        assert_eq!((paired.d_over_tau.difference, paired.d_peak.n), (None, 1));
        after.iter_mut().for_each(|record| record.header.id.base_seed = 5);
        assert!(pair_episodes(&before, &after).is_empty(), "other initial states");
    }

    /// Fields of records of this version in addition to those of [`run`].
    fn with_harm(mut record: EpisodeRecord, contact: bool, failed_stage: Option<TaskStage>) -> EpisodeRecord {
        let v = &mut record.verdict;
        let of = v.object_mut();
        (of.d_mean, of.d_final, of.d_p95, of.time_over_tau_s) = (Some(0.25), Some(0.0), Some(0.5), Some(1.5));
        v.first_wrong_contact = contact.then(|| WrongObjectContact { time_s: 2.0, object: "bun".to_owned() });
        v.others_ok = Some(!contact);
        v.failed_stage = failed_stage;
        record
    }

    #[test]
    fn harm_and_stages_are_paired_and_invalid_episodes_have_no_values() {
        let base = run(&[(true, true, 0.5), (false, false, 0.5), (false, false, 0.5), (true, true, 0.5)]);
        let side = |rows: [(bool, Option<TaskStage>); 4]| -> Vec<EpisodeRecord> {
            base.iter()
                .zip(rows)
                .map(|(record, (contact, stage))| with_harm(record.clone(), contact, stage))
                .collect()
        };
        let before = side([
            (true, None),
            (true, Some(TaskStage::Grasp)),
            (false, Some(TaskStage::Reach)),
            (false, None),
        ]);
        let mut after = side([
            (false, None),
            (true, Some(TaskStage::Carry)),
            (false, Some(TaskStage::Reach)),
            (true, Some(TaskStage::Place)),
        ]);
        after[0].verdict.object_mut().d_mean = Some(0.75);
        after[3].verdict.object_mut().collapsed_volume_pct = Some(9.0);
        // An invalid episode touched something and has a stage; it has no D, no volume, and unknown harm.
        after[3].outcome = Outcome::Invalid { reason: InvalidReason::Inverted, step: 3, node: None };
        after[3].verdict.others_ok = None;
        let paired = PairedComparison::from_pairs(&pair_episodes(&before, &after));
        assert_eq!((paired.pairs, paired.invalid_pairs), (4, 1));
        let contact = paired.wrong_contact;
        assert_eq!((contact.first, contact.second, counts(contact)), (Some(50.0), Some(50.0), [1, 1, 2]));
        let d = paired.d_mean;
        assert_eq!((d.n, d.better, d.worse), (3, 0, 1));
        assert_eq!((d.first, d.second), (Some(0.25), Some(1.25 / 3.0)));
        let [last, p95, over] = [paired.d_final, paired.d_p95, paired.time_over_tau_s];
        assert_eq!([last, p95, over].map(|of| (of.n, of.same)), [(3, 3); 3]);
        let volumes = [paired.collapsed_volume_pct, paired.damaged_volume_pct];
        assert_eq!(
            volumes.map(|of| (of.n, of.first, of.second)),
            [(3, Some(1.25), Some(1.25)), (3, Some(0.5), Some(0.5))]
        );
        assert_eq!((paired.others_ok.n, counts(paired.others_ok)), (3, [1, 0, 2]));
        let stages = paired.failed_stages;
        assert_eq!(stages.first, BTreeMap::from([(TaskStage::Reach, 1), (TaskStage::Grasp, 1)]));
        assert_eq!(
            stages.second,
            BTreeMap::from([(TaskStage::Reach, 1), (TaskStage::Carry, 1), (TaskStage::Place, 1)])
        );
        assert_eq!((stages.n, stages.better, stages.worse), (4, 1, 1));
    }

    #[test]
    fn what_a_run_never_judged_has_no_pairs() {
        let judged = run(&[(true, true, 0.5), (true, false, 1.5)]);
        let mut unjudged = judged.clone();
        for record in &mut unjudged {
            let object = record.verdict.object_mut();
            (object.deformation_ok, object.tau) = (None, None);
            (record.verdict.safety, record.verdict.safety_known) = (false, false);
        }
        let compared = |first: &[EpisodeRecord], second: &[EpisodeRecord]| {
            PairedComparison::from_pairs(&pair_episodes(first, second))
        };
        for paired in [compared(&judged, &unjudged), compared(&unjudged, &judged)] {
            assert_eq!((paired.goal.n, paired.safety, paired.dsr.n), (2, PairedDifference::default(), 0));
        }
        // One judged episode is enough: the others count as failed.
        unjudged[0] = judged[0].clone();
        let paired = compared(&judged, &unjudged);
        assert_eq!((paired.safety.n, paired.safety.second, paired.dsr.n), (2, Some(50.0), 2));
        // Rigid targets have no limit, and so no Safety Success.
        for record in &mut unjudged {
            record.verdict.targets = vec![TargetVerdict::default()];
        }
        let paired = compared(&unjudged, &judged);
        assert_eq!((paired.goal.n, paired.safety.n, paired.dsr.n), (2, 0, 0));
    }

    #[test]
    fn tasks_of_the_same_number_in_two_suites_stay_apart() {
        let mut records = run(&[(true, true, 0.5), (true, true, 0.6), (true, true, 0.7)]);
        records[1].header.id.suite = "other".into();
        (records[2].header.id.task, records[2].header.id.episode) = (1, 0);
        let all = pair_episodes(&records, &records);
        let tasks: Vec<_> = group_by_task(&all)
            .map(|pairs| {
                let id = &pairs[0].first.header.id;
                (id.suite.as_str(), id.task, pairs.len())
            })
            .collect();
        assert_eq!(tasks, [("other", 0, 1), ("suite", 0, 1), ("suite", 1, 1)]);
    }

    #[test]
    fn an_interval_agrees_with_one_computed_by_hand() {
        // 100 pairs, 12 gained, 4 lost: centre 8/102, half 1.96 √(17 − 64/102)/102.
        let pairs = (0..100).map(|i| [i < 4, (4..16).contains(&i)]);
        let of = PairedDifference::from_successes(pairs);
        assert_eq!((of.n, of.better, of.worse, of.same), (100, 12, 4, 84));
        assert_eq!((of.first, of.second), (Some(4.0), Some(12.0)));
        assert!((of.difference.unwrap() - 8.0).abs() < 1e-12);
        let [low, high] = of.interval95.unwrap();
        assert!((low - 0.067_3).abs() < 2e-3 && (high - 15.619).abs() < 2e-3, "{low} {high}");
        // 2 (1 + 16 + 120 + 560 + 1820) / 2¹⁶.
        assert!((of.p.unwrap() - 2.0 * 2517.0 / 65536.0).abs() < 1e-12, "{:?}", of.p);
    }

    #[test]
    fn a_bootstrap_is_near_the_normal_interval_and_the_same_every_time() {
        let pairs: Vec<[f64; 2]> = (0..400).map(|i| [0.0, 1.0 + f64::from(i % 20) / 20.0]).collect();
        let of = PairedDifference::from_values(pairs.clone());
        let [low, high] = of.interval95.unwrap();
        // Standard deviation 0.2884, so ± 1.96 × 0.2884 / 20.
        assert!((high - low - 0.0565).abs() < 0.005, "{low} {high}");
        assert_eq!(of, PairedDifference::from_values(pairs));
        assert_eq!((of.n, of.better, of.worse, of.same, of.first), (400, 0, 400, 0, Some(0.0)));
        assert_eq!(PairedDifference::from_values([[1.0, 3.0]]).interval95, None);
    }
}
