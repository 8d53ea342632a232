//! Goals of tasks: predicates of the true scene, and their combinations.

use serde::{Deserialize, Serialize};
use softvt_common::text::exact_number;

/// Success condition of a task, judged at every control step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Goal {
    /// The object rests on the target, released, for `hold_s`.
    On(Placement),
    /// The object rests in the cavity of the target, released, for `hold_s`.
    #[serde(rename = "in")]
    Inside(Placement),
    /// A joint is open by a share of its range or more.
    Opened {
        /// Part of an articulated object: `cabinet.top_drawer`.
        joint: String,
        /// Smallest share of the range, 0..=1.
        share: f64,
    },
    /// A joint is open by a share of its range or less.
    Closed {
        joint: String,
        /// Largest share of the range, 0..=1.
        share: f64,
    },
    Turned {
        joint: String,
        /// Lowest and highest position, rad of a hinge and m of a slider.
        range: [f64; 2],
    },
    /// The object is near the target, and the robot does not touch it.
    Near {
        /// The object, the target, and how long the relation must hold.
        #[serde(flatten)]
        of: Placement,
        /// Largest horizontal distance of the centres, m.
        distance_m: f64,
    },
    /// The object is on a side of the target, and the robot does not touch it.
    Beside {
        side: Side,
        /// The object, the target, and how long the relation must hold.
        #[serde(flatten)]
        of: Placement,
        /// Smallest distance of the centres towards that side, m.
        distance_m: f64,
    },
    /// The object is upright, and the robot does not touch it.
    Upright {
        object: String,
        hold_s: f64,
        /// Largest angle between its z axis and the vertical, rad.
        angle_rad: f64,
    },
    Predicate {
        /// Description of the condition, as records and reports show it.
        name: String,
    },
    All(SubGoals),
    Any(SubGoals),
    None(SubGoals),
    /// Each of these has held once after the one before it had; the last one holds.
    Sequence(SubGoals),
}

/// An object, what it is placed relative to, and for how long.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    pub object: String,
    pub target: String,
    /// Time for which the object must stay, s.
    pub hold_s: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SubGoals {
    pub goals: Vec<Goal>,
}

/// A side of an object, seen along the x axis of the robot's base.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Towards +y of the base.
    LeftOf,
    /// Towards −y of the base.
    RightOf,
    /// Towards the base, −x.
    InFrontOf,
    /// Away from the base, +x.
    Behind,
}

impl Side {
    pub fn words(self) -> &'static str {
        match self {
            Self::LeftOf => "left of",
            Self::RightOf => "right of",
            Self::InFrontOf => "in front of",
            Self::Behind => "behind",
        }
    }

    /// The side on which the other one of two objects is.
    pub fn opposite(self) -> Self {
        match self {
            Self::LeftOf => Self::RightOf,
            Self::RightOf => Self::LeftOf,
            Self::InFrontOf => Self::Behind,
            Self::Behind => Self::InFrontOf,
        }
    }
}

impl Goal {
    /// Its predicates, in the order in which they are written.
    pub fn predicates(&self) -> Vec<&Self> {
        match self {
            Self::All(parts) | Self::Any(parts) | Self::None(parts) | Self::Sequence(parts) => {
                parts.goals.iter().flat_map(Self::predicates).collect()
            }
            _ => vec![self],
        }
    }

    fn placement(&self) -> Option<&Placement> {
        match self {
            Self::On(of) | Self::Inside(of) | Self::Near { of, .. } | Self::Beside { of, .. } => Some(of),
            _ => None,
        }
    }

    /// Scene name of the object that a predicate moves; `None` for a joint, a function and a combination.
    pub fn object(&self) -> Option<&str> {
        match self {
            Self::Upright { object, .. } => Some(object),
            _ => self.placement().map(|of| of.object.as_str()),
        }
    }

    /// Scene name of what a predicate places its object relative to.
    pub fn target(&self) -> Option<&str> {
        self.placement().map(|of| of.target.as_str())
    }

    /// Scene name of the part whose joint a predicate is about.
    pub fn joint(&self) -> Option<&str> {
        match self {
            Self::Opened { joint, .. } | Self::Closed { joint, .. } | Self::Turned { joint, .. } => {
                Some(joint)
            }
            _ => None,
        }
    }

    /// The goal with the ranges of joints in place of shares, m or rad, where `limits` knows the lowest and highest
    /// value of a joint. Values are rounded to a micrometre or microradian.
    pub fn with_joint_ranges(&self, limits: &impl Fn(&str) -> Option<[f64; 2]>) -> Self {
        let rounded = |value: f64| (1e6 * value).round() / 1e6;
        let mut goal = self.clone();
        match &mut goal {
            Self::Opened { joint, share } | Self::Closed { joint, share } => {
                if let Some([low, high]) = limits(joint) {
                    let shares =
                        if matches!(self, Self::Opened { .. }) { [*share, 1.0] } else { [0.0, *share] };
                    let range = shares.map(|share| rounded(low + share * (high - low)));
                    return Self::Turned { joint: joint.clone(), range };
                }
            }
            Self::Turned { range, .. } => *range = range.map(rounded),
            Self::All(of) | Self::Any(of) | Self::None(of) | Self::Sequence(of) => {
                of.goals.iter_mut().for_each(|part| *part = part.with_joint_ranges(limits));
            }
            _ => {}
        }
        goal
    }

    /// Description of the goal: "bun in cabinet.top_drawer". A sequence within another combination is in parentheses,
    /// so that goals of other meaning differ in text.
    pub fn describe(&self) -> String {
        let joined = |parts: &SubGoals, word: &str| {
            let part = |goal: &Self| match goal {
                Self::Sequence(steps) if steps.goals.len() > 1 && parts.goals.len() > 1 => {
                    format!("({})", goal.describe())
                }
                _ => goal.describe(),
            };
            parts.goals.iter().map(part).collect::<Vec<_>>().join(word)
        };
        match self {
            Self::On(Placement { object, target, .. }) => format!("{object} on {target}"),
            Self::Inside(Placement { object, target, .. }) => format!("{object} in {target}"),
            Self::Opened { joint, .. } => format!("{joint} open"),
            Self::Closed { joint, .. } => format!("{joint} closed"),
            Self::Turned { joint, range: [low, high] } => {
                format!("{joint} turned to {}..{}", exact_number(*low), exact_number(*high))
            }
            Self::Near { of: Placement { object, target, .. }, .. } => format!("{object} near {target}"),
            Self::Beside { side, of: Placement { object, target, .. }, .. } => {
                format!("{object} {} {target}", side.words())
            }
            Self::Upright { object, .. } => format!("{object} upright"),
            Self::Predicate { name } => name.clone(),
            Self::All(parts) => joined(parts, " and "),
            Self::Any(parts) => format!("({})", joined(parts, " or ")),
            Self::None(parts) => format!("not ({})", joined(parts, " or ")),
            Self::Sequence(parts) => joined(parts, ", then "),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_of_other_meaning_have_other_descriptions() {
        let named = |name: &str| Goal::Predicate { name: name.into() };
        let (a, b) = (|| named("A"), || named("B"));
        let of = |goals: Vec<Goal>| SubGoals { goals };
        let all = |goals| Goal::All(of(goals));
        let sequence = |goals| Goal::Sequence(of(goals));
        let not_a = || Goal::None(of(vec![a()]));
        assert_eq!(all(vec![sequence(vec![a(), not_a()]), b()]).describe(), "(A, then not (A)) and B");
        assert_eq!(sequence(vec![a(), all(vec![not_a(), b()])]).describe(), "A, then not (A) and B");
        assert_eq!(sequence(vec![a(), sequence(vec![b(), a()])]).describe(), "A, then (B, then A)");
        assert_eq!(Goal::None(of(vec![sequence(vec![a(), b()])])).describe(), "not (A, then B)");
        assert_eq!(all(vec![sequence(vec![a(), b()])]).describe(), "A, then B");
        assert_eq!(Goal::Any(of(vec![all(vec![a(), b()]), b()])).describe(), "(A and B or B)");
    }
}
