//! Selection of demonstrations: the attempts that are due, and those that are kept.

use std::collections::BTreeMap;

use crate::evaluation::record::{EpisodeRecord, Outcome};

/// Prefix of the error of an attempt that could not start from the state of its demonstration.
pub(crate) const START_FAILED: &str = "cannot reproduce the initial state: ";

/// Attempts to run next, so that the first `demos` good ones are found whatever the order in which attempts finish.
/// `finished` maps each finished attempt to true if it is good; at most `max` attempts are run.
pub(crate) fn due(finished: &BTreeMap<u32, bool>, demos: u32, max: u32) -> Vec<u32> {
    let mut end = 0;
    loop {
        let missing: Vec<u32> = (0..end).filter(|attempt| !finished.contains_key(attempt)).collect();
        let good = finished.range(..end).filter(|(_, good)| **good).count() as u32;
        if !missing.is_empty() || good >= demos || end == max {
            return missing;
        }
        end = (end + demos - good).min(max);
    }
}

/// The reason for which an attempt is not kept. `None` if it is.
pub(crate) fn rejection(record: &EpisodeRecord) -> Option<String> {
    let verdict = &record.verdict;
    let reason = match &record.outcome {
        _ if verdict.safety => return None,
        Outcome::Invalid { reason, .. } => return Some(format!("invalid ({reason})")),
        Outcome::Error { message } if message.starts_with(START_FAILED) => "could not start",
        Outcome::Error { .. } => "ended by an error",
        _ if record.stats.gave_up.is_some() => "given up",
        _ if !verdict.goal => "goal not reached",
        _ if !verdict.no_drop => "dropped",
        _ if verdict.deformation_ok == Some(false) => "deformed too much",
        _ if record.header.soft && verdict.tau.is_none() => "without a known limit of deformation",
        _ => "not safe",
    };
    Some(reason.to_owned())
}

/// Formats an attempt as one line of progress.
pub(crate) fn attempt_line(record: &EpisodeRecord) -> String {
    let id = &record.header.id;
    let result = match (rejection(record), &record.outcome) {
        (None, _) => "kept".to_owned(),
        (Some(reason), Outcome::Error { message }) => format!("not kept: {reason} ({message})"),
        (Some(reason), _) => format!("not kept: {reason}"),
    };
    format!("task {} attempt {}: {result}, {:.1} s", id.task, id.episode, record.stats.time_s)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Runs attempts that are kept if `good` is true of their number. Returns their numbers and how many were kept. If
    /// `interrupted`, only the last attempt of each round finishes.
    fn record(good: impl Fn(u32) -> bool, demos: u32, max: u32, interrupted: bool) -> (BTreeSet<u32>, usize) {
        let mut done = BTreeMap::new();
        loop {
            let mut next = due(&done, demos, max);
            if next.is_empty() {
                let kept = done.values().filter(|good| **good).count();
                return (done.into_keys().collect(), kept);
            }
            if interrupted {
                next = next.split_off(next.len() - 1);
            }
            done.extend(next.into_iter().map(|attempt| (attempt, good(attempt))));
        }
    }

    #[test]
    fn attempts_depend_only_on_the_outcomes_of_earlier_ones() {
        let good = |attempt: u32| !attempt.is_multiple_of(3);
        let (run, kept) = record(good, 10, 100, false);
        assert_eq!(run, (0..15).collect(), "attempt 14 is the tenth good one");
        assert_eq!(kept, 10);
        assert_eq!(record(good, 10, 100, true), (run, kept));
        assert_eq!(record(|_| true, 7, 100, false), ((0..7).collect(), 7));
    }

    #[test]
    fn attempts_stop_at_their_maximum() {
        assert_eq!(record(|_| false, 5, 12, false), ((0..12).collect(), 0));
        assert_eq!(record(|attempt| attempt == 3, 2, 8, true), ((0..8).collect(), 1));
    }
}
