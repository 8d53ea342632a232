//! Readings of the gripper's numbers: what they would have to mean to agree with the recorded closures.

use super::{
    agreement::{AGREES, AnswerAgreement, NumberPair, median},
    sampling::StepSample,
};
use softvt_policy::profile::{GripCode, GripperValues};

/// Range of closures below which a gripper does not move.
const STILL: f64 = 0.05;
/// Error of a closure from which on another reading is looked for, and the share of the recorded range.
const WRONG: f64 = 0.25;
const WRONG_SHARE: f64 = 0.5;
/// Share of the error that another reading may leave.
const LEFT: f64 = 0.3;

/// Numbers of an open and a closed gripper.
#[derive(Clone, Copy, Debug)]
struct GripRange {
    name: &'static str,
    open: f64,
    closed: f64,
}

const fn range(name: &'static str, open: f64, closed: f64) -> GripRange {
    GripRange { name, open, closed }
}

/// Ranges of grippers in use.
const RANGES: [GripRange; 16] = [
    range("closures", 0.0, 1.0),
    range("openings", 1.0, 0.0),
    range("closures", -1.0, 1.0),
    range("openings", 1.0, -1.0),
    range("closures", 0.0, 255.0),
    range("openings", 255.0, 0.0),
    range("closures", 0.0, 100.0),
    range("openings", 100.0, 0.0),
    range("closures", 0.0, 1000.0),
    range("openings", 1000.0, 0.0),
    range("finger positions in m", 0.04, 0.0),
    range("widths in m", 0.08, 0.0),
    range("finger positions in mm", 40.0, 0.0),
    range("widths in mm", 80.0, 0.0),
    range("reversed finger positions in m", 0.0, 0.04),
    range("reversed widths in m", 0.0, 0.08),
];

/// A range and the error of closures that are read in it.
#[derive(Clone, Copy, Debug)]
struct Explanation {
    range: GripRange,
    error: f64,
}

/// Recorded closures and answered ones.
pub(super) fn closures(steps: &[StepSample]) -> Vec<NumberPair> {
    let pair = |s: &StepSample| NumberPair { recorded: s.recorded.action.closure(), answered: s.closure };
    steps.iter().map(pair).collect()
}

/// Names what is wrong with the gripper.
pub(super) fn explain_grip(
    pairs: &[NumberPair],
    of: &AnswerAgreement,
    values: Option<GripperValues>,
) -> Option<String> {
    let recorded = sorted(pairs.iter().map(|pair| pair.recorded));
    let (low, high) = (*recorded.first()?, *recorded.last()?);
    if high - low <= STILL {
        return None;
    }
    let own = values.filter(|values| values.code != GripCode::Force);
    let own = own.map_or(RANGES[0], |values| range("", values.open, values.closed));
    let middle = 0.5 * (low + high);
    let before = error(pairs, middle, &own, &own);
    let r = of.correlation.unwrap_or(0.0);
    let is_wrong = r <= -AGREES || r >= AGREES && before >= WRONG.min(WRONG_SHARE * (high - low));
    if is_wrong {
        let inverted = range("", own.closed, own.open);
        let explain = |range: GripRange| Explanation { range, error: error(pairs, middle, &own, &range) };
        let explained = [inverted].into_iter().chain(RANGES).map(explain);
        let explained: Vec<Explanation> = explained.filter(|one| one.error <= LEFT * before).collect();
        let least = explained.iter().map(|one| one.error).fold(f64::INFINITY, f64::min);
        if let Some(best) = explained.into_iter().find(|one| one.error <= 4.0 / 3.0 * least + 0.02) {
            return Some(words(&own, &best, before));
        }
    }
    let of_closed = || pairs.iter().filter(|pair| pair.recorded > middle).map(|pair| pair.answered);
    if r >= AGREES
        && values.is_some_and(|values| values.code == GripCode::Binary)
        && median(of_closed()) <= 0.5
    {
        return Some(format!(
            "gripper: the grip code is binary, which closes above the middle of open and closed, and the answers where the demonstrations \
             are closed are closures of {:.2} in the median, so that the hand stays open: train on actions_binary, or choose --gripper \
             continuous",
            median(of_closed())
        ));
    }
    let answered = sorted(pairs.iter().map(|pair| pair.answered));
    let spread = answered[answered.len() * 19 / 20] - answered[answered.len() / 20];
    if r.abs() < AGREES && spread < STILL {
        return Some(format!(
            "gripper: every answer commands the same closure, {:.3}: check the normalisation of the actions, and the values of \
             open and closed in the profile",
            median(answered.into_iter())
        ));
    }
    if r <= -AGREES {
        return Some(inverted_words(&format!("correlation {r:.2}")));
    }
    if r < AGREES {
        return Some(format!("gripper: the answers do not follow the demonstrations (correlation {r:.2})"));
    }
    (before > 1.0).then(|| {
        let value = |closure: f64| own.open + closure * (own.closed - own.open);
        let [first, last] = [0, answered.len() - 1].map(|k| value(answered[k]));
        format!(
            "gripper: the answers lie between {first:.3} and {last:.3}; {} (open) to {} (closed) is expected: see the values of \
             open and closed in the profile",
            own.open, own.closed
        )
    })
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Error of the closures that answers mean in a range: the larger one of open and closed grippers. A gripper that opens
/// and closes fully agrees with one that is told the width.
fn error(pairs: &[NumberPair], middle: f64, own: &GripRange, read: &GripRange) -> f64 {
    let closure = |answered: f64| {
        let number = own.open + answered * (own.closed - own.open);
        (number - read.open) / (read.closed - read.open)
    };
    let of_group = |is_closed: bool, target: &dyn Fn(f64) -> f64| {
        let group = pairs.iter().filter(|pair| (pair.recorded > middle) == is_closed);
        median(group.map(|pair| (closure(pair.answered) - target(pair.recorded)).abs()))
    };
    let of = |target: &dyn Fn(f64) -> f64| of_group(false, target).max(of_group(true, target));
    of(&|recorded| recorded).min(of(&|recorded| f64::from(u8::from(recorded > middle))))
}

fn inverted_words(evidence: &str) -> String {
    format!(
        "gripper: the answers are inverted: they close where the demonstrations open ({evidence}): see the values of open and \
         closed in the profile"
    )
}

fn words(own: &GripRange, best: &Explanation, before: f64) -> String {
    let evidence = format!("error {before:.2} of the closure as received, {:.2} so read", best.error);
    let GripRange { name, open, closed } = best.range;
    if open == own.closed && closed == own.open {
        return inverted_words(&evidence);
    }
    format!(
        "gripper: the answers look like {name}, {open} (open) to {closed} (closed) ({evidence}): {} (open) to {} (closed) is \
         expected; convert them, or state these values in a profile",
        own.open, own.closed
    )
}
