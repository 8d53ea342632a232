//! Readings of answered orientations: what they would have to mean to agree with the recorded ones.

use super::{
    agreement::{
        AGREEING_SCALES, AGREES, AnswerAgreement, AxisChange, CLEARLY_BETTER, EXPLAINS, VectorPair,
        axis_changes, correlation, factor, mean, median,
    },
    position::Evidence,
    sampling::StepSample,
};
use softvt_common::text::AXIS_NAMES;
use softvt_geometry::{Mat3, Quat, Vec3};
use softvt_robot::rotation;

/// Rotations below which a step says nothing, rad.
const LEAST_ROTATION_RAD: f64 = 5e-3;
/// Mean error below which orientations agree: 3°.
const PRECISE_RAD: f64 = 0.05;
/// Mean error from which on orientations that no reading explains do not follow: 15°.
const ASTRAY_RAD: f64 = 0.26;
/// The same of steps: 1.5°.
const ASTRAY_STEP_RAD: f64 = 0.026;
/// Error of another reading up to which it ties with the best, besides a third, rad.
const TIE_RAD: f64 = 2e-3;

/// Order of the numbers of a quaternion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum QuaternionOrder {
    Xyzw,
    Wxyz,
    /// Without w, which is positive.
    Xyz,
}

/// Euler angles: turns about three axes, in order of the numbers.
#[derive(Clone, Copy, Debug)]
struct EulerAngles {
    axes: [usize; 3],
    /// True if the axes turn along.
    is_intrinsic: bool,
    unit: f64,
}

/// A meaning of the answered orientations.
#[derive(Clone, Copy, Debug)]
enum Reading {
    Degrees,
    Quaternion(QuaternionOrder),
    Euler(EulerAngles),
    Transposed,
    Axes(AxisChange),
    /// A rotation from the orientation in the observation, about the axes of the base or those of the tool.
    Relative {
        about_tool: bool,
    },
    /// Recorded rotations about the axes of the base, executed about those of the tool.
    ToolSide,
    /// A constant rotation besides, about axes of the base or of the tool.
    Turned {
        by: Quat,
        about_tool: bool,
    },
    /// The orientation in the observation.
    Held,
}

/// A reading and its error.
#[derive(Clone, Copy, Debug)]
struct Explanation {
    reading: Reading,
    error: f64,
}

/// What was found about rotations.
#[derive(Clone, Debug)]
pub(super) struct RotationFinding {
    pub text: String,
    /// The turn from the frame of the answers to that of the base, if that is what is wrong.
    pub frame_turn: Option<Mat3>,
    /// True if the numbers are those of a quaternion, whose last one took the place of the gripper's.
    pub has_taken_grip: bool,
}

/// Rotation vector from the measured orientation of the tool to that of an action, about the axes of the base.
fn turn(s: &StepSample, axis_angle_b: &Vec3) -> Vec3 {
    let start = if s.is_step { s.tool } else { s.request };
    rotation::error(&start.orientation, &rotation::from_axis_angle(axis_angle_b))
}

/// Rotations of all steps in which the tool turns.
pub(super) fn turns(steps: &[StepSample]) -> Vec<VectorPair> {
    let pair = |s: &StepSample| VectorPair {
        recorded: turn(s, &s.recorded.action.axis_angle_b),
        answered: turn(s, &s.answered.axis_angle_b),
    };
    steps.iter().map(pair).filter(|pair| pair.recorded.norm() >= LEAST_ROTATION_RAD).collect()
}

fn recorded(s: &StepSample) -> Quat {
    rotation::from_axis_angle(&s.recorded.action.axis_angle_b)
}

impl EulerAngles {
    fn decode(self, angles: &Vec3) -> Quat {
        let about = |i: usize| {
            let axis = Vec3::ith(self.axes[i], 1.0);
            Quat::from_scaled_axis(axis * (self.unit * angles[i]))
        };
        match self.is_intrinsic {
            true => about(0) * about(1) * about(2),
            false => about(2) * about(1) * about(0),
        }
    }

    fn name(self) -> String {
        let axes = self.axes.map(|axis| AXIS_NAMES[axis]).join(", ");
        let frame = if self.is_intrinsic { "turning" } else { "fixed" };
        let unit = if self.unit == 1.0 { "rad" } else { "degrees" };
        format!("Euler angles about the {frame} axes {axes}, {unit}")
    }
}

impl Reading {
    fn decode(&self, s: &StepSample) -> Option<Quat> {
        let numbers = s.answered.axis_angle_b;
        let own = || rotation::from_axis_angle(&numbers);
        let request = s.request.orientation;
        Some(match self {
            Self::Degrees => rotation::from_axis_angle(&numbers.map(f64::to_radians)),
            Self::Quaternion(order) => quaternion(s, *order)?,
            Self::Euler(euler) => euler.decode(&numbers),
            Self::Transposed => own().inverse(),
            Self::Axes(change) => rotation::from_axis_angle(&(change.to_base * numbers)),
            Self::Relative { about_tool: false } => own() * request,
            Self::Relative { about_tool: true } => request * own(),
            Self::ToolSide => {
                let side = request.inverse() * own();
                side * request
            }
            Self::Turned { by, about_tool: false } => by * own(),
            Self::Turned { by, about_tool: true } => own() * by,
            Self::Held => request,
        })
    }

    fn error(&self, steps: &[StepSample]) -> Option<f64> {
        if matches!(self, Self::Held) {
            // The recorded orientation says nothing of whether the answer is held.
            let own = |s: &StepSample| rotation::from_axis_angle(&s.answered.axis_angle_b);
            return Some(mean(steps.iter().map(|s| s.request.orientation.angle_to(&own(s)))));
        }
        let errors = steps.iter().map(|s| Some(self.decode(s)?.angle_to(&recorded(s))));
        Some(mean(errors.collect::<Option<Vec<f64>>>()?.into_iter()))
    }

    fn words(&self, evidence: &Evidence) -> String {
        let expected = "axis-angle in rad about the axes of the robot's base is expected";
        let looks = |what: &str| format!("rotation: the answers look like {what} ({evidence}): {expected}");
        match self {
            Self::Degrees => looks("axis-angle in degrees"),
            Self::Quaternion(QuaternionOrder::Xyzw) => looks("quaternions x, y, z, w"),
            Self::Quaternion(QuaternionOrder::Wxyz) => looks("quaternions w, x, y, z"),
            Self::Quaternion(QuaternionOrder::Xyz) => looks("x, y, z of quaternions"),
            Self::Euler(euler) => looks(&euler.name()),
            Self::Transposed => looks(
                "inverse (transposed) rotations, from the base to the tool in place of from the tool to the base",
            ),
            Self::Axes(change) => axes_words(change, evidence),
            Self::Relative { about_tool } => {
                let axes = if *about_tool { "tool" } else { "base" };
                looks(&format!(
                    "rotations relative to the tool pose in the observation, about the axes of the {axes}"
                ))
            }
            Self::ToolSide => tool_words(evidence),
            Self::Turned { by, about_tool } => {
                let vector = by.inverse().scaled_axis().map(|x| x.to_degrees().round() + 0.0);
                let (frame, remedy) = match about_tool {
                    true => (
                        "tool",
                        "orientations of the tool are expected: check which frame of the hand is commanded",
                    ),
                    false => ("base", "orientations in the frame of the robot's base are expected"),
                };
                format!(
                    "rotation: the answers are turned by the constant ({:.0}, {:.0}, {:.0})° about (x, y, z) of the {frame} \
                     ({evidence}): {remedy}",
                    vector.x, vector.y, vector.z
                )
            }
            Self::Held => format!(
                "rotation: the answers keep the orientation of the observation: they lie {:.1}° from it in the mean, and {:.1}° \
                 from the recorded ones: check what the policy was trained to predict",
                evidence.after.to_degrees(),
                evidence.before.to_degrees()
            ),
        }
    }
}

fn tool_words(evidence: &Evidence) -> String {
    format!(
        "rotation: the answers are turned about the axes of the tool ({evidence}): rotations are expected about those of the \
         robot's base"
    )
}

fn axes_words(change: &AxisChange, evidence: &Evidence) -> String {
    format!(
        "rotation: (x, y, z) of the answers are {} of the demonstrations ({evidence}): use the axes of the robot's base, x \
         forward, y left, z up",
        change.name()
    )
}

/// The quaternion in the numbers of an answer; `None` if they have another length.
fn quaternion(s: &StepSample, order: QuaternionOrder) -> Option<Quat> {
    let v = s.answered.axis_angle_b;
    let last = match &s.row {
        Some(row) => *row.last()?,
        None => s.closure,
    };
    let q = match order {
        QuaternionOrder::Xyzw => quaternion_of(last, v),
        QuaternionOrder::Wxyz => quaternion_of(v.x, Vec3::new(v.y, v.z, last)),
        QuaternionOrder::Xyz => quaternion_of((1.0 - v.norm_squared()).max(0.0).sqrt(), v),
    };
    (0.8..1.2).contains(&q.norm()).then(|| Quat::from_quaternion(q))
}

fn quaternion_of(w: f64, v: Vec3) -> nalgebra::Quaternion<f64> {
    nalgebra::Quaternion::new(w, v.x, v.y, v.z)
}

/// Names what is wrong with rotations.
pub(super) fn explain_rotation(steps: &[StepSample], of: &AnswerAgreement) -> Option<RotationFinding> {
    if steps.iter().any(|s| s.is_step) {
        let text = explain_steps(&turns(steps), steps, of)?;
        return Some(RotationFinding { text, frame_turn: None, has_taken_grip: false });
    }
    let own = Reading::Axes(axis_changes()[0]);
    let before = own.error(steps).filter(|error| *error >= PRECISE_RAD)?;
    let Some(Explanation { reading, error }) = best_reading(steps, before) else {
        let text = "rotation: the answers do not follow the demonstrations: check its encoding (axis-angle, quaternion order, \
                    side)";
        return (before >= ASTRAY_RAD).then(|| RotationFinding {
            text: text.to_owned(),
            frame_turn: None,
            has_taken_grip: false,
        });
    };
    let frame_turn = match reading {
        Reading::Turned { by, about_tool: false } => Some(by.to_rotation_matrix().into_inner()),
        _ => None,
    };
    let has_taken_grip = matches!(reading, Reading::Quaternion(order) if order != QuaternionOrder::Xyz);
    let text = reading.words(&evidence(before, error));
    Some(RotationFinding { text, frame_turn, has_taken_grip })
}

fn evidence(before: f64, after: f64) -> Evidence {
    Evidence { before, after, unit: "°", scale: 180.0 / std::f64::consts::PI }
}

/// The first reading that is about as good as the best, if it is clearly better than the answers as received.
fn best_reading(steps: &[StepSample], before: f64) -> Option<Explanation> {
    let explain = |reading: Reading| Some(Explanation { reading, error: reading.error(steps)? });
    let explained = readings(steps).into_iter().filter_map(explain);
    let explained: Vec<Explanation> =
        explained.filter(|one| one.error <= CLEARLY_BETTER * before && one.error <= ASTRAY_RAD).collect();
    let least = explained.iter().map(|one| one.error).fold(f64::INFINITY, f64::min);
    explained.into_iter().find(|one| one.error <= 4.0 / 3.0 * least + TIE_RAD)
}

/// All readings that are considered, the plainest first.
fn readings(steps: &[StepSample]) -> Vec<Reading> {
    let mut all = vec![
        Reading::Degrees,
        Reading::Quaternion(QuaternionOrder::Xyzw),
        Reading::Quaternion(QuaternionOrder::Wxyz),
        Reading::Quaternion(QuaternionOrder::Xyz),
    ];
    for unit in [1.0, std::f64::consts::PI / 180.0] {
        for is_intrinsic in [false, true] {
            let orders = [[0, 1, 2], [2, 1, 0], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1]];
            all.extend(orders.map(|axes| Reading::Euler(EulerAngles { axes, is_intrinsic, unit })));
        }
    }
    all.push(Reading::Transposed);
    all.extend([false, true].map(|about_tool| Reading::Relative { about_tool }));
    all.push(Reading::Held);
    all.extend(axis_changes()[1..].iter().map(|change| Reading::Axes(*change)));
    all.push(Reading::ToolSide);
    all.extend([false, true].map(|about_tool| constant_turn(steps, about_tool)));
    all
}

/// The mean rotation between answered and recorded orientations.
fn constant_turn(steps: &[StepSample], about_tool: bool) -> Reading {
    let between = |s: &StepSample| {
        let answered = rotation::from_axis_angle(&s.answered.axis_angle_b);
        if about_tool { answered.inverse() * recorded(s) } else { recorded(s) * answered.inverse() }
    };
    let first = steps.first().map_or(Quat::identity(), between);
    // Relative to the first, whose half turns would otherwise have two signs.
    let vectors: Vec<Vec3> = steps.iter().map(|s| rotation::error(&first, &between(s))).collect();
    let middle = Vec3::from_fn(|i, _| median(vectors.iter().map(|vector| vector[i])));
    Reading::Turned { by: rotation::from_axis_angle(&middle) * first, about_tool }
}

/// Names what is wrong with rotations that are displacements.
fn explain_steps(pairs: &[VectorPair], steps: &[StepSample], of: &AnswerAgreement) -> Option<String> {
    let distance = |pairs: &[VectorPair]| mean(pairs.iter().map(|p| (p.answered - p.recorded).norm()));
    let before = distance(pairs);
    // A few turned steps say little.
    if pairs.len() < 10 || before < LEAST_ROTATION_RAD {
        return None;
    }
    let better = |read: &[VectorPair]| {
        let after = distance(read);
        let is_better = after <= CLEARLY_BETTER * before && correlation(read).is_some_and(|r| r >= EXPLAINS);
        is_better.then(|| evidence(before, after))
    };
    let turned =
        steps.iter().filter(|s| turn(s, &s.recorded.action.axis_angle_b).norm() >= LEAST_ROTATION_RAD);
    let of_tool =
        turned.zip(pairs).map(|(s, p)| VectorPair { answered: s.tool.orientation * p.answered, ..*p });
    if let Some(evidence) = better(&of_tool.collect::<Vec<_>>()) {
        return Some(tool_words(&evidence));
    }
    let scale = factor(pairs).filter(|scale| !AGREEING_SCALES.contains(scale) && *scale > 0.0);
    if let (Some(scale), Some(r)) = (scale, of.correlation.filter(|r| *r >= AGREES)) {
        let is_degrees = (30.0..=100.0).contains(&scale);
        let unit = if is_degrees {
            "radians are expected, these look like degrees"
        } else {
            "check the scale of the profile's actions, and whether their normalisation was undone"
        };
        return Some(format!(
            "rotation: the answers are {scale:.3} times as large as the recorded ones (correlation {r:.2}): {unit}"
        ));
    }
    let changed = axis_changes().into_iter().skip(1).filter_map(|change| {
        let read = pairs.iter().map(|p| VectorPair { answered: change.to_base * p.answered, ..*p });
        Some((change, better(&read.collect::<Vec<_>>())?))
    });
    let best = changed.min_by(|(_, a), (_, b)| a.after.total_cmp(&b.after));
    if let Some((change, evidence)) = best {
        return Some(axes_words(&change, &evidence));
    }
    (!of.agrees() && before >= ASTRAY_STEP_RAD).then(|| {
        "rotation: the answers do not follow the demonstrations: check its encoding (axis-angle, quaternion order, side)"
            .to_owned()
    })
}
