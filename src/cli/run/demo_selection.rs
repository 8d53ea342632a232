//! Attempts at demonstrations: which are due, which are good, and how they are told.

use std::collections::BTreeMap;

use crate::evaluation::record::{EpisodeRecord, Outcome};

/// What the error of an attempt begins with that could not start as its demonstration says.
pub(crate) const NO_START: &str = "cannot start as the demonstration says: ";

/// Attempts that must be run before anything can be said of more; `done` says of each that is done whether it is good.
pub(crate) fn due(done: &BTreeMap<u32, bool>, demos: u32, most: u32) -> Vec<u32> {
    let mut end = 0;
    loop {
        let missing: Vec<u32> = (0..end).filter(|attempt| !done.contains_key(attempt)).collect();
        let good = done.range(..end).filter(|(_, good)| **good).count() as u32;
        if !missing.is_empty() || good >= demos || end == most {
            return missing;
        }
        end = (end + demos - good).min(most);
    }
}

/// Why an attempt is no demonstration; none if it is.
pub(crate) fn rejected(record: &EpisodeRecord) -> Option<String> {
    let verdict = &record.verdict;
    let reason = match &record.outcome {
        _ if verdict.safety => return None,
        Outcome::Invalid { reason, .. } => return Some(format!("invalid ({reason})")),
        Outcome::Error { message } if message.starts_with(NO_START) => "could not start",
        Outcome::Error { .. } => "ended by an error",
        _ if record.stats.gave_up.is_some() => "given up",
        _ if !verdict.goal => "goal not reached",
        _ if !verdict.no_drop => "dropped",
        _ if verdict.deformation_ok == Some(false) => "deformed too much",
        _ if record.identity.soft && verdict.tau.is_none() => "without a known limit of deformation",
        _ => "not safe",
    };
    Some(reason.to_owned())
}

/// One attempt in one line.
pub(crate) fn line(record: &EpisodeRecord) -> String {
    let id = &record.identity;
    let said = match (rejected(record), &record.outcome) {
        (None, _) => "kept".to_owned(),
        (Some(reason), Outcome::Error { message }) => format!("not kept: {reason} ({message})"),
        (Some(reason), _) => format!("not kept: {reason}"),
    };
    format!("task {} attempt {}: {said}, {:.1} s", id.task, id.episode, record.stats.time_s)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Runs attempts of which `good` says what becomes, in any order, and returns which were run.
    fn record(good: impl Fn(u32) -> bool, demos: u32, most: u32, broken_off: bool) -> (BTreeSet<u32>, usize) {
        let mut done = BTreeMap::new();
        loop {
            let mut next = due(&done, demos, most);
            if next.is_empty() {
                let kept = done.values().filter(|good| **good).count();
                return (done.into_keys().collect(), kept);
            }
            if broken_off {
                // The last of a round is all that is finished.
                next = next.split_off(next.len() - 1);
            }
            done.extend(next.into_iter().map(|attempt| (attempt, good(attempt))));
        }
    }

    #[test]
    fn which_attempts_are_run_depends_on_nothing_but_what_becomes_of_them() {
        let good = |attempt: u32| !attempt.is_multiple_of(3);
        let (run, kept) = record(good, 10, 100, false);
        assert_eq!(run, (0..15).collect(), "attempt 14 is the tenth good one");
        assert_eq!(kept, 10);
        assert_eq!(record(good, 10, 100, true), (run, kept));
        assert_eq!(record(|_| true, 7, 100, false), ((0..7).collect(), 7));
    }

    #[test]
    fn attempts_end_at_their_limit() {
        assert_eq!(record(|_| false, 5, 12, false), ((0..12).collect(), 0));
        assert_eq!(record(|attempt| attempt == 3, 2, 8, true), ((0..8).collect(), 1));
    }
}
