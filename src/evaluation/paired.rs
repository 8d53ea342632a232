//! Two runs of the same episodes, compared one by one: a run under a condition against its reference.
//!
//! Pairs share task, initial state and seed, so that what differs between them is the condition alone.

use std::{cmp::Ordering, collections::BTreeMap};

use serde::{Deserialize, Serialize};

use super::{record::EpisodeRecord, statistics::mean};

/// How many pairs went better, worse, or the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// Pairs that are better than the reference.
    pub better: usize,
    /// Pairs that are worse.
    pub worse: usize,
    /// Pairs that are the same.
    pub same: usize,
}

impl Change {
    fn count(&mut self, order: Ordering) {
        *match order {
            Ordering::Greater => &mut self.better,
            Ordering::Less => &mut self.worse,
            Ordering::Equal => &mut self.same,
        } += 1;
    }
}

/// A condition against its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Paired {
    /// Episodes that both runs have.
    pub pairs: usize,
    /// Goal Success; an invalid episode has none, here and below.
    pub goal: Change,
    /// NoDrop.
    pub no_drop: Change,
    /// Safety Success.
    pub safety: Change,
    /// D/τ of pairs of which both have it: less is better.
    pub d_over_tau: Change,
    /// Mean difference of D/τ over these pairs; null without any.
    pub d_over_tau_mean: Option<f64>,
}

/// Peak D over τ of a valid episode; none without a limit or a measurement.
pub fn d_over_tau(record: &EpisodeRecord) -> Option<f64> {
    let verdict = &record.verdict;
    let (d, tau) = verdict.d_peak.zip(verdict.tau)?;
    (record.outcome.is_valid() && tau > 0.0).then_some(d / tau)
}

impl Paired {
    /// `changed` against `reference`, paired by task and episode; what only one of them has is left out.
    pub fn of(reference: &[EpisodeRecord], changed: &[EpisodeRecord]) -> Self {
        let key = |r: &EpisodeRecord| (r.identity.task, r.identity.episode);
        let known: BTreeMap<_, _> = reference.iter().map(|record| (key(record), record)).collect();
        let mut all = Self::default();
        let mut differences = Vec::new();
        for after in changed {
            let Some(before) = known.get(&key(after)) else { continue };
            all.pairs += 1;
            let order = |what: fn(&EpisodeRecord) -> bool| {
                let of = |record: &EpisodeRecord| record.outcome.is_valid() && what(record);
                of(after).cmp(&of(before))
            };
            all.goal.count(order(|r| r.verdict.goal));
            all.no_drop.count(order(|r| r.verdict.no_drop));
            all.safety.count(order(|r| r.verdict.safety));
            if let Some((before, after)) = d_over_tau(before).zip(d_over_tau(after)) {
                all.d_over_tau.count(before.total_cmp(&after));
                differences.push(after - before);
            }
        }
        all.d_over_tau_mean = mean(&differences);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::record::{Outcome, tests::sample};

    /// Goal, safety and D of each episode; τ is 1.
    fn run(episodes: &[(bool, bool, f64)]) -> Vec<EpisodeRecord> {
        let record = |(i, &(goal, safety, d)): (usize, &(bool, bool, f64))| {
            let mut record = sample();
            record.identity.episode = i as u32;
            (record.verdict.goal, record.verdict.safety, record.verdict.d_peak) = (goal, safety, Some(d));
            record
        };
        episodes.iter().enumerate().map(record).collect()
    }

    fn change(better: usize, worse: usize, same: usize) -> Change {
        Change { better, worse, same }
    }

    #[test]
    fn pairs_are_compared_one_by_one_whatever_their_order() {
        let before = run(&[(true, true, 0.5), (true, false, 1.5), (false, false, 0.2), (true, true, 0.4)]);
        let mut after =
            run(&[(true, false, 1.25), (true, true, 0.75), (false, false, 0.2), (false, false, 0.4)]);
        after.reverse();
        let paired = Paired::of(&before, &after);
        assert_eq!((paired.pairs, paired.goal, paired.safety), (4, change(0, 1, 3), change(1, 2, 1)));
        assert_eq!(paired.d_over_tau, change(1, 1, 2));
        assert_eq!(paired.d_over_tau_mean, Some(0.0));
    }

    #[test]
    fn a_run_against_itself_changes_nothing() {
        let same = run(&[(true, true, 0.5), (false, false, 2.0)]);
        let paired = Paired::of(&same, &same);
        assert_eq!([paired.goal, paired.no_drop, paired.safety, paired.d_over_tau], [change(0, 0, 2); 4]);
        assert_eq!(paired.d_over_tau_mean, Some(0.0));
    }

    #[test]
    fn an_invalid_episode_is_worse_and_has_no_deformation_and_strangers_are_left_out() {
        let before = run(&[(true, true, 0.5), (true, true, 0.5)]);
        let mut after = run(&[(true, true, 0.6), (true, true, 0.6), (true, true, 0.6)]);
        after[1].outcome = Outcome::Invalid { reason: "inverted".into(), step: 3, node: None };
        let paired = Paired::of(&before, &after);
        assert_eq!((paired.pairs, paired.goal, paired.no_drop), (2, change(0, 1, 1), change(0, 1, 1)));
        assert_eq!(paired.d_over_tau, change(0, 1, 0));
        after[0].verdict.tau = None;
        assert_eq!(Paired::of(&before, &after).d_over_tau_mean, None);
    }
}
