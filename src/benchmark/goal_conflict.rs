//! Goals that no state can meet.

use std::collections::BTreeMap;

use softvt_common::text::significant;

use crate::goal::{Goal, Placement, SubGoals};

/// The reason for which a goal can never be met, in words; `None` if none was found.
///
/// Predicates that must hold at once are compared in pairs, and what rests on what must not be a circle. Of
/// `softvt.any`, each alternative is compared with what must hold at the same time. Of geometry, only distances of the
/// same two objects are considered, and shares of a joint are compared with its values only in a goal of
/// [`Goal::with_joint_ranges`].
pub fn conflict(goal: &Goal) -> Option<String> {
    let moment = Moment::of(goal);
    if let Some(found) = moment.conflict() {
        return Some(found);
    }
    if let Some(found) = moment.earlier.iter().find_map(|step| conflict(step)) {
        return Some(found);
    }
    moment.alternatives.iter().find_map(|parts| {
        let conflicts = parts.goals.iter().map(|part| {
            let mut with = Moment { earlier: Vec::new(), ..moment.clone() };
            with.add(part);
            with.conflict()
        });
        conflicts.collect::<Option<Vec<String>>>().and_then(|mut found| found.pop())
    })
}

/// Least time that a goal takes, s: its predicates must hold for a time.
pub fn least_time(goal: &Goal) -> f64 {
    let times = |parts: &SubGoals| parts.goals.iter().map(least_time).collect::<Vec<_>>();
    match goal {
        Goal::On(of) | Goal::Inside(of) | Goal::Near { of, .. } | Goal::Beside { of, .. } => of.hold_s,
        Goal::Upright { hold_s, .. } => *hold_s,
        Goal::All(parts) => times(parts).into_iter().fold(0.0, f64::max),
        Goal::Any(parts) => times(parts).into_iter().reduce(f64::min).unwrap_or(0.0),
        Goal::Sequence(parts) => times(parts).iter().sum(),
        Goal::None(parts) => parts.goals.iter().map(least_time_without).fold(0.0, f64::max),
        Goal::Opened { .. } | Goal::Closed { .. } | Goal::Turned { .. } | Goal::Predicate { .. } => 0.0,
    }
}

/// Least time after which a goal can have been false for as long as it would have to hold, s.
fn least_time_without(goal: &Goal) -> f64 {
    let times = |parts: &SubGoals| parts.goals.iter().map(least_time_without).collect::<Vec<_>>();
    match goal {
        Goal::All(parts) => times(parts).into_iter().reduce(f64::min).unwrap_or(0.0),
        Goal::Any(parts) => times(parts).into_iter().fold(0.0, f64::max),
        Goal::Sequence(_) | Goal::None(_) => 0.0,
        predicate => least_time(predicate),
    }
}

/// Goals at one moment.
#[derive(Clone, Default)]
struct Moment<'a> {
    required: Vec<&'a Goal>,
    forbidden: Vec<&'a Goal>,
    /// Of each list, one must hold.
    alternatives: Vec<&'a SubGoals>,
    /// Earlier steps of sequences, each of which must hold at a moment of its own.
    earlier: Vec<&'a Goal>,
}

impl<'a> Moment<'a> {
    fn of(goal: &'a Goal) -> Self {
        let mut moment = Self::default();
        moment.add(goal);
        moment
    }

    fn add(&mut self, goal: &'a Goal) {
        match goal {
            Goal::All(parts) => parts.goals.iter().for_each(|part| self.add(part)),
            Goal::None(parts) => parts.goals.iter().for_each(|part| self.forbid(part)),
            Goal::Any(parts) => match &parts.goals[..] {
                [only] => self.add(only),
                _ => self.alternatives.push(parts),
            },
            Goal::Sequence(parts) => {
                if let Some((last, earlier)) = parts.goals.split_last() {
                    self.earlier.extend(earlier);
                    self.add(last);
                }
            }
            predicate => self.required.push(predicate),
        }
    }

    /// Adds a goal that must not hold. A sequence within `softvt.none` may not have begun, so that it forbids nothing.
    fn forbid(&mut self, goal: &'a Goal) {
        match goal {
            Goal::Any(parts) => parts.goals.iter().for_each(|part| self.forbid(part)),
            Goal::All(parts) | Goal::None(parts) if parts.goals.len() == 1 => {
                if matches!(goal, Goal::All(_)) {
                    self.forbid(&parts.goals[0]);
                } else {
                    self.add(&parts.goals[0]);
                }
            }
            Goal::None(parts) => self.alternatives.push(parts),
            Goal::All(_) | Goal::Sequence(_) => {}
            predicate => self.forbidden.push(predicate),
        }
    }

    fn conflict(&self) -> Option<String> {
        if let Some(both) = self.required.iter().find(|goal| self.forbidden.contains(goal)) {
            return Some(format!("{:?} must hold and must not hold", both.describe()));
        }
        for forbidden in &self.forbidden {
            if let Some(required) = self.required.iter().find(|required| implies(required, forbidden)) {
                let [required, forbidden] = [required, forbidden].map(|goal| with_limit(goal));
                return Some(format!("{required} must hold and {forbidden} must not, which follows from it"));
            }
        }
        for (at, first) in self.required.iter().enumerate() {
            if let Some(other) = self.required[at + 1..].iter().find(|other| excludes(first, other)) {
                let [first, other] = [first, other].map(|goal| goal.describe());
                return Some(format!("{first:?} and {other:?} cannot hold at once"));
            }
        }
        self.circle().map(|objects| format!("{} rest on each other in a circle", objects.join(", ")))
    }

    /// Objects that would have to rest on each other in a circle.
    fn circle(&self) -> Option<Vec<&'a str>> {
        let mut supports: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for goal in &self.required {
            if let Goal::On(of) | Goal::Inside(of) = goal {
                supports.entry(&of.object).or_default().push(&of.target);
            }
        }
        supports.keys().find_map(|object| circle_from(&supports, vec![object]))
    }
}

/// A path of supports from the first object of `path` back to it.
fn circle_from<'a>(supports: &BTreeMap<&'a str, Vec<&'a str>>, path: Vec<&'a str>) -> Option<Vec<&'a str>> {
    let below = supports.get(path.last()?)?;
    if below.contains(&path[0]) {
        return Some(path);
    }
    let further = below.iter().filter(|next| !path.contains(next));
    further.into_iter().find_map(|next| circle_from(supports, path.iter().copied().chain([*next]).collect()))
}

/// A quantity of a scene that predicates bound. Pairs of objects are in alphabetical order.
#[derive(PartialEq)]
enum Quantity<'a> {
    JointShare(&'a str),
    /// Value of a joint, m or rad.
    JointValue(&'a str),
    /// Angle between the z axis of an object and the vertical, rad.
    Tilt(&'a str),
    /// Distance of two objects, m.
    Distance([&'a str; 2]),
    /// Number of the side of the second object on which the first one is. Each is within 45° of its direction.
    Side([&'a str; 2]),
}

/// The lowest and highest values of the quantities that a predicate bounds, while it holds.
fn bounds(goal: &Goal) -> Vec<(Quantity<'_>, [f64; 2])> {
    let is_sorted = |of: &Placement| of.object <= of.target;
    match goal {
        Goal::Opened { joint, share } => vec![(Quantity::JointShare(joint), [*share, 1.0])],
        Goal::Closed { joint, share } => vec![(Quantity::JointShare(joint), [0.0, *share])],
        Goal::Turned { joint, range } => vec![(Quantity::JointValue(joint), *range)],
        Goal::Upright { object, angle_rad, .. } => vec![(Quantity::Tilt(object), [0.0, *angle_rad])],
        Goal::Near { of, distance_m } => vec![(Quantity::Distance(pair(of)), [0.0, *distance_m])],
        Goal::Beside { side, of, distance_m } => {
            let side = f64::from(if is_sorted(of) { *side } else { side.opposite() } as u8);
            vec![
                (Quantity::Distance(pair(of)), [*distance_m, f64::INFINITY]),
                (Quantity::Side(pair(of)), [side; 2]),
            ]
        }
        _ => Vec::new(),
    }
}

fn pair(of: &Placement) -> [&str; 2] {
    let mut pair = [of.object.as_str(), of.target.as_str()];
    pair.sort_unstable();
    pair
}

/// True if two predicates can never hold at once: they bound a quantity to ranges that are apart.
fn excludes(first: &Goal, other: &Goal) -> bool {
    let others = bounds(other);
    bounds(first).iter().any(|(quantity, [low, high])| {
        others.iter().any(|(same, [from, to])| quantity == same && (low > to || from > high))
    })
}

/// True if a predicate that holds makes another one hold, which bounds the same quantities to wider ranges, of the same
/// object, which the robot does not touch, and for no longer.
fn implies(holds: &Goal, other: &Goal) -> bool {
    let (own, others) = (bounds(holds), bounds(other));
    let follows = |(quantity, [from, to]): &(Quantity<'_>, [f64; 2])| {
        own.iter().any(|(same, [low, high])| quantity == same && from <= low && high <= to)
    };
    holds.object() == other.object()
        && least_time(holds) >= least_time(other)
        && !others.is_empty()
        && others.iter().all(follows)
}

/// A predicate with the limit that tells it from others of the same words.
fn with_limit(goal: &Goal) -> String {
    let mm = |metres: f64| format!("{} mm", significant(1e3 * metres, 4));
    let limit = match goal {
        Goal::Near { distance_m, .. } => format!(" (at most {})", mm(*distance_m)),
        Goal::Beside { distance_m, .. } => format!(" (at least {})", mm(*distance_m)),
        Goal::Upright { angle_rad, .. } => format!(" (within {}°)", significant(angle_rad.to_degrees(), 4)),
        Goal::Opened { share, .. } => format!(" (at least {} %)", significant(1e2 * share, 4)),
        Goal::Closed { share, .. } => format!(" (at most {} %)", significant(1e2 * share, 4)),
        _ => String::new(),
    };
    format!("{:?}{limit}", goal.describe())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_time_of_a_goal_is_that_of_its_longest_way() {
        let held = |hold_s| Goal::Upright { object: "a".into(), hold_s, angle_rad: 0.1 };
        let both = || vec![held(6.0), held(5.0)];
        let combinations: [fn(SubGoals) -> Goal; 4] = [Goal::Sequence, Goal::All, Goal::Any, Goal::None];
        let least = combinations.map(|combined| least_time(&combined(SubGoals { goals: both() })));
        assert_eq!(least, [11.0, 6.0, 5.0, 6.0]);
        let none_of = combinations.map(|combined| {
            least_time(&Goal::None(SubGoals { goals: vec![combined(SubGoals { goals: both() })] }))
        });
        assert_eq!(none_of[1..], [5.0, 6.0, 0.0]);
    }
}
