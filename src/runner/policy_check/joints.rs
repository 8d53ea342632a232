//! Readings of answered joint positions: what they would have to mean to agree with the recorded ones.

use super::{
    agreement::{AnswerAgreement, CLEARLY_BETTER, mean, median},
    sampling::StepSample,
};
use softvt_robot::{
    ik::ArmAngles,
    panda::{self, JointRange},
};

/// Number of joints.
const JOINTS: usize = 7;
/// Mean error of a joint below which it agrees, rad: 3°.
const PRECISE_RAD: f64 = 0.05;
/// Largest mean error of all joints that a reading may leave, rad.
const ASTRAY_RAD: f64 = 0.15;
/// Error of another reading up to which it ties with the best, besides a third, rad.
const TIE_RAD: f64 = 5e-3;
/// Constant difference of a joint below which it is a matter of precision, rad.
const LEAST_OFFSET_RAD: f64 = 0.1;

/// Answered and recorded joint positions of a control step, rad.
#[derive(Clone, Copy, Debug)]
struct JointPair {
    recorded: ArmAngles,
    answered: ArmAngles,
    /// Measured at the request.
    measured: ArmAngles,
}

/// What is wrong with one joint.
#[derive(Clone, Copy, Debug)]
enum JointFault {
    None,
    Reversed,
    /// The answer less the recorded position, rad.
    Offset(f64),
}

/// A meaning of the answered joint positions.
#[derive(Clone, Copy, Debug)]
enum Reading {
    Degrees,
    Relative,
    /// The joint of the answers that each joint of the arm is.
    Order([usize; JOINTS]),
    Faults([JointFault; JOINTS]),
}

/// A reading and its error.
#[derive(Clone, Copy, Debug)]
struct Explanation {
    reading: Reading,
    error: f64,
}

impl Reading {
    fn decode(&self, pair: &JointPair) -> ArmAngles {
        let answered = pair.answered;
        std::array::from_fn(|i| match self {
            Self::Degrees => answered[i].to_radians(),
            Self::Relative => answered[i] + pair.measured[i],
            Self::Order(order) => answered[order[i]],
            Self::Faults(faults) => match faults[i] {
                JointFault::None => answered[i],
                JointFault::Reversed => -answered[i],
                JointFault::Offset(offset) => answered[i] - offset,
            },
        })
    }

    fn words(&self, evidence: &str) -> String {
        match self {
            Self::Degrees => {
                format!("joints: radians are expected, these look like degrees ({evidence})")
            }
            Self::Relative => format!(
                "joints: the answers are relative to the joint positions in the observation ({evidence}): absolute positions are \
                 expected; add them"
            ),
            Self::Order(order) => {
                let others: Vec<String> = (0..JOINTS)
                    .filter(|i| order[*i] != *i)
                    .map(|i| format!("joint {} is answered as joint {}", i + 1, order[i] + 1))
                    .collect();
                format!(
                    "joints: the order differs: {} ({evidence}): joints are expected from the base on",
                    others.join(", ")
                )
            }
            Self::Faults(faults) => {
                let of_joint = |(i, fault): (usize, &JointFault)| match fault {
                    JointFault::None => None,
                    JointFault::Reversed => Some(format!("joint {} is reversed", i + 1)),
                    JointFault::Offset(offset) => {
                        Some(format!("joint {} is off by the constant {:.1}°", i + 1, offset.to_degrees()))
                    }
                };
                let all: Vec<String> = faults.iter().enumerate().filter_map(of_joint).collect();
                format!(
                    "joints: {} ({evidence}): the zeros and directions of the arm's joints are expected",
                    all.join(", ")
                )
            }
        }
    }
}

/// True if the answers are joint positions.
pub(super) fn are_joints(steps: &[StepSample]) -> bool {
    steps.iter().any(|s| s.answered.joints.is_some())
}

/// Names what is wrong with joint positions.
pub(super) fn explain_joints(steps: &[StepSample], translation: &AnswerAgreement) -> Option<String> {
    let pair = |s: &StepSample| {
        let (recorded, answered) = (s.recorded.joints?, s.answered.joints?);
        Some(JointPair { recorded, answered, measured: s.request_joints })
    };
    let pairs: Vec<JointPair> = steps.iter().filter_map(pair).collect();
    let of_joint = |i: usize| mean(pairs.iter().map(|p| (p.answered[i] - p.recorded[i]).abs()));
    let before: ArmAngles = std::array::from_fn(of_joint);
    let worst = (0..JOINTS).max_by(|a, b| before[*a].total_cmp(&before[*b]))?;
    if !pairs.is_empty() && before[worst] >= PRECISE_RAD {
        let mean_before = mean(before.into_iter());
        if let Some(Explanation { reading, error }) = best_reading(&pairs, &before) {
            let evidence = format!("mean error {mean_before:.3} rad as received, {error:.3} rad so read");
            return Some(reading.words(&evidence));
        }
    }
    outside_limits(steps).or_else(|| {
        (!translation.agrees() && translation.n >= 10).then(|| {
            format!(
                "joints: the answers do not follow the demonstrations (joint {} is off by {:.2} rad in the mean): check the \
                 images, the order of the joints, and the normalisation of state and actions",
                worst + 1,
                before[worst]
            )
        })
    })
}

/// The first reading that is about as good as the best, if it is clearly better than the answers as received.
fn best_reading(pairs: &[JointPair], before: &ArmAngles) -> Option<Explanation> {
    let limit = (CLEARLY_BETTER * mean(before.iter().copied())).min(ASTRAY_RAD);
    let all = [Reading::Degrees, Reading::Relative, Reading::Order(best_order(pairs)), faults(pairs, before)];
    let explain = |reading: Reading| {
        let of_pair = |p: &JointPair| {
            let read = reading.decode(p);
            mean((0..JOINTS).map(|i| (read[i] - p.recorded[i]).abs()))
        };
        Explanation { reading, error: mean(pairs.iter().map(of_pair)) }
    };
    let explained: Vec<Explanation> = all.into_iter().map(explain).filter(|one| one.error <= limit).collect();
    let least = explained.iter().map(|one| one.error).fold(f64::INFINITY, f64::min);
    explained.into_iter().find(|one| one.error <= 4.0 / 3.0 * least + TIE_RAD)
}

/// The order of joints with the least error.
fn best_order(pairs: &[JointPair]) -> [usize; JOINTS] {
    let cost: [ArmAngles; JOINTS] = std::array::from_fn(|i| {
        std::array::from_fn(|j| mean(pairs.iter().map(|p| (p.answered[j] - p.recorded[i]).abs())))
    });
    let of = |order: &[usize; JOINTS]| (0..JOINTS).map(|i| cost[i][order[i]]).sum::<f64>();
    let mut best: [usize; JOINTS] = std::array::from_fn(|i| i);
    let mut order = best;
    permute(&mut order, 0, &mut |order| {
        if of(order) < of(&best) - 1e-9 {
            best = *order;
        }
    });
    best
}

/// Visits all orders of the joints from `first` on.
fn permute(order: &mut [usize; JOINTS], first: usize, visit: &mut impl FnMut(&[usize; JOINTS])) {
    if first == JOINTS {
        return visit(order);
    }
    for k in first..JOINTS {
        order.swap(first, k);
        permute(order, first + 1, visit);
        order.swap(first, k);
    }
}

/// Signs and offsets of the joints that do not agree.
fn faults(pairs: &[JointPair], before: &ArmAngles) -> Reading {
    let of_joint = |i: usize| {
        if before[i] < PRECISE_RAD {
            return JointFault::None;
        }
        let offset = median(pairs.iter().map(|p| p.answered[i] - p.recorded[i]));
        let moved = mean(pairs.iter().map(|p| (p.answered[i] - offset - p.recorded[i]).abs()));
        let reversed = mean(pairs.iter().map(|p| (p.answered[i] + p.recorded[i]).abs()));
        let limit = CLEARLY_BETTER * before[i];
        match () {
            () if reversed <= limit && reversed <= 4.0 / 3.0 * moved + TIE_RAD => JointFault::Reversed,
            () if moved <= limit && offset.abs() >= LEAST_OFFSET_RAD => JointFault::Offset(offset),
            () => JointFault::None,
        }
    };
    Reading::Faults(std::array::from_fn(of_joint))
}

/// Joint positions of answers that are outside of the limits of their joints.
fn outside_limits(steps: &[StepSample]) -> Option<String> {
    /// Joint positions beyond any limit, rad: half of the answers exceed it if they are in degrees.
    const DEGREES: f64 = 10.0;
    let answers: Vec<ArmAngles> = steps.iter().filter_map(|s| s.answered.joints).collect();
    let ranges = panda::joint_ranges();
    let outside = |joint: usize| answers.iter().filter(|q| !ranges[joint].contains(q[joint])).count();
    let joint = (0..ranges.len()).max_by_key(|joint| outside(*joint))?;
    if 2 * outside(joint) <= answers.len() {
        return None;
    }
    let largest = answers.iter().map(|q| q.iter().fold(0.0, |most: f64, x| most.max(x.abs())));
    let unit = if median(largest) > DEGREES {
        ": radians are expected, these look like degrees"
    } else {
        ": check the order of the joints, and whether the normalisation was undone"
    };
    let JointRange { lower, upper } = ranges[joint];
    Some(format!(
        "joints: {} of {} answers have joint {} outside of its limits, {lower} to {upper} rad{unit}",
        outside(joint),
        answers.len(),
        joint + 1
    ))
}
