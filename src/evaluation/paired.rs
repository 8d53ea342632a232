//! Two runs of the same episodes, compared one by one: two policies, or a condition and its reference.
//!
//! Pairs share suite, task, initial state and seed, so that what differs between them is what was changed alone.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    difference::{MeanDifference, RateDifference},
    record::EpisodeRecord,
};

/// One episode in both runs.
pub type Pair<'a> = (&'a EpisodeRecord, &'a EpisodeRecord);

/// What makes an episode of two runs the same: suite, task, episode, seed, split, layout.
pub type Key<'a> = (&'a str, usize, u32, u64, &'a str, &'a str);

/// Which episode a record is of.
pub fn key(record: &EpisodeRecord) -> Key<'_> {
    let id = &record.identity;
    (&id.suite, id.task, id.episode, id.seed, &id.split, &id.layout)
}

/// The episodes that both runs have, in their order, whatever that of the records is; what only one of them has is left
/// out. An episode may be there only once in each run.
pub fn pairs<'a>(
    first: impl IntoIterator<Item = &'a EpisodeRecord>,
    second: impl IntoIterator<Item = &'a EpisodeRecord>,
) -> Vec<Pair<'a>> {
    let second: BTreeMap<Key, &EpisodeRecord> = second.into_iter().map(|r| (key(r), r)).collect();
    let first: BTreeMap<Key, &EpisodeRecord> = first.into_iter().map(|r| (key(r), r)).collect();
    first.into_iter().filter_map(|(key, a)| Some((a, *second.get(&key)?))).collect()
}

/// The pairs of each task, by suite and task.
pub fn by_task<'a>(pairs: &[Pair<'a>]) -> BTreeMap<(&'a str, usize), Vec<Pair<'a>>> {
    let mut tasks: BTreeMap<(&str, usize), Vec<Pair>> = BTreeMap::new();
    for pair in pairs {
        tasks.entry((&pair.0.identity.suite, pair.0.identity.task)).or_default().push(*pair);
    }
    tasks
}

/// How the second of some pairs differ from the first. An invalid episode succeeds at nothing and has no deformation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Paired {
    /// Episodes that both runs have.
    pub pairs: usize,
    /// Goal Success, points.
    pub goal: RateDifference,
    /// NoDrop, points.
    pub no_drop: RateDifference,
    /// Safety Success, points.
    pub safety: RateDifference,
    /// Peak D where both have one, % of the diagonal.
    pub d_peak: MeanDifference,
    /// Peak D over τ where both have both.
    pub d_over_tau: MeanDifference,
}

/// Peak D of a valid episode, % of the diagonal; none without a measurement.
pub fn d_peak(record: &EpisodeRecord) -> Option<f64> {
    record.verdict.d_peak.filter(|_| record.outcome.is_valid())
}

/// Peak D over τ of a valid episode; none without a limit or a measurement.
pub fn d_over_tau(record: &EpisodeRecord) -> Option<f64> {
    let (d, tau) = d_peak(record).zip(record.verdict.tau)?;
    (tau > 0.0).then_some(d / tau)
}

impl Paired {
    /// Of some pairs.
    pub fn of(pairs: &[Pair]) -> Self {
        let rate = |test: fn(&EpisodeRecord) -> bool| {
            let holds = |r: &EpisodeRecord| r.outcome.is_valid() && test(r);
            RateDifference::of(pairs.iter().map(|(a, b)| (holds(a), holds(b))))
        };
        let mean = |what: fn(&EpisodeRecord) -> Option<f64>| {
            MeanDifference::of(pairs.iter().filter_map(|(a, b)| what(a).zip(what(b))))
        };
        Self {
            pairs: pairs.len(),
            goal: rate(|r| r.verdict.goal),
            no_drop: rate(|r| r.verdict.no_drop),
            safety: rate(|r| r.verdict.safety),
            d_peak: mean(d_peak),
            d_over_tau: mean(d_over_tau),
        }
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

    fn counts(of: RateDifference) -> [usize; 3] {
        [of.better, of.worse, of.same]
    }

    #[test]
    fn pairs_are_compared_one_by_one_whatever_their_order() {
        let before = run(&[(true, true, 0.5), (true, false, 1.5), (false, false, 0.2), (true, true, 0.4)]);
        let mut after =
            run(&[(true, false, 1.25), (true, true, 0.75), (false, false, 0.2), (false, false, 0.4)]);
        after.reverse();
        let paired = Paired::of(&pairs(&before, &after));
        assert_eq!((paired.pairs, counts(paired.goal), counts(paired.safety)), (4, [0, 1, 3], [1, 2, 1]));
        let d = paired.d_over_tau;
        assert_eq!((d.better, d.worse, d.same, d.difference), (1, 1, 2, Some(0.0)));
        assert_eq!(paired.d_peak, d, "τ is 1");
    }

    #[test]
    fn a_run_against_itself_changes_nothing() {
        let same = run(&[(true, true, 0.5), (false, false, 2.0)]);
        let paired = Paired::of(&pairs(&same, &same));
        assert_eq!([paired.goal, paired.no_drop, paired.safety].map(counts), [[0, 0, 2]; 3]);
        assert_eq!((paired.d_over_tau.same, paired.d_over_tau.interval95), (2, Some([0.0, 0.0])));
    }

    #[test]
    fn an_invalid_episode_is_worse_and_has_no_deformation_and_strangers_are_left_out() {
        let before = run(&[(true, true, 0.5), (true, true, 0.5)]);
        let mut after = run(&[(true, true, 0.6), (true, true, 0.6), (true, true, 0.6)]);
        after[1].outcome = Outcome::Invalid { reason: "inverted".into(), step: 3, node: None };
        let paired = Paired::of(&pairs(&before, &after));
        assert_eq!((paired.pairs, counts(paired.goal), counts(paired.no_drop)), (2, [0, 1, 1], [0, 1, 1]));
        assert_eq!((paired.d_over_tau.n, paired.d_over_tau.worse), (1, 1));
        after[0].verdict.tau = None;
        let paired = Paired::of(&pairs(&before, &after));
        assert_eq!((paired.d_over_tau.difference, paired.d_peak.n), (None, 1));
        after.iter_mut().for_each(|record| record.identity.seed = 5);
        assert!(pairs(&before, &after).is_empty(), "other initial states");
    }

    #[test]
    fn tasks_of_the_same_number_in_two_suites_stay_apart() {
        let mut records = run(&[(true, true, 0.5), (true, true, 0.6), (true, true, 0.7)]);
        records[1].identity.suite = "other".into();
        (records[2].identity.task, records[2].identity.episode) = (1, 0);
        let all = pairs(&records, &records);
        let tasks: Vec<_> = by_task(&all).into_iter().map(|(task, pairs)| (task, pairs.len())).collect();
        assert_eq!(tasks, [(("other", 0), 1), (("suite", 0), 1), (("suite", 1), 1)]);
    }
}
