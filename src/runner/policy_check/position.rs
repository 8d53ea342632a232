//! Readings of answered positions: what they would have to mean to agree with the recorded ones.

use std::fmt;

use super::{
    agreement::{
        AGREEING_SCALES, AGREES, AnswerAgreement, AxisChange, CLEARLY_BETTER, EXPLAINS, NumberPair,
        OF_SPREAD, VectorPair, axis_changes, correlation, factor, line, mean, median,
    },
    sampling::StepSample,
};
use softvt_geometry::{Mat3, Vec3};

/// Displacements below which a translation says nothing, m.
const LEAST_TRANSLATION_M: f64 = 1e-3;
/// Constant difference of positions below which it is a matter of precision, m.
const LEAST_OFFSET_M: f64 = 0.02;
/// Error of another reading up to which it ties with the best, besides a third, m.
const TIE_M: f64 = 3e-4;
/// Correlation of each axis from which on it follows the recorded one.
const FOLLOWS: f64 = 0.9;

/// What an answered position refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reference {
    /// The pose in the observation of the request.
    Request,
    /// The pose when the action is executed.
    Tool,
}

/// Axes of a displacement.
#[derive(Clone, Copy, Debug)]
enum Axes {
    /// Axes of the base, exchanged or reversed.
    Base(AxisChange),
    /// Axes of the tool.
    Tool,
}

/// A meaning of the answered positions.
#[derive(Clone, Debug)]
enum Reading {
    /// Positions in other units, axes or frames: `scale · axes · answer + offset`.
    Absolute { scale: f64, axes: AxisChange, offset: Vec3 },
    /// Displacements in place of positions.
    Relative { reference: Reference, axes: Axes, scale: f64 },
    /// Positions whose displacement from the tool is scaled or turned.
    Displaced { axes: Axes, scale: f64 },
    /// Positions in place of displacements.
    Positions,
    /// Numbers of each axis with a factor and an offset of their own.
    Normalized { scale: Vec3, offset: Vec3 },
    /// One position for all steps.
    Constant { position: Vec3 },
}

/// What was found about translations.
#[derive(Clone, Debug)]
pub(super) struct PositionFinding {
    /// The sentence.
    pub text: String,
    /// True if the answers are displacements or positions where the other is expected; orientations are then as well.
    pub is_other_encoding: bool,
    /// The turn from the frame of the answers to that of the base, if that is what is wrong.
    pub frame_turn: Option<Mat3>,
}

/// A reading and its errors.
#[derive(Clone, Debug)]
struct Explanation {
    reading: Reading,
    error: f64,
}

/// The error of answers as they are received, and read in another way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    pub before: f64,
    pub after: f64,
    /// Unit, with the space before it.
    pub unit: &'static str,
    /// Factor from SI units to `unit`.
    pub scale: f64,
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { before, after, unit, scale } = self;
        write!(f, "mean error {}{unit} as received, ", short(scale * before))?;
        write!(f, "{}{unit} so read", short(scale * after))
    }
}

/// A number with about three digits.
fn short(x: f64) -> String {
    match x.abs() {
        100.0.. => format!("{x:.0}"),
        1.0.. => format!("{x:.1}"),
        0.1.. => format!("{x:.2}"),
        1e-4.. => format!("{x:.4}"),
        _ => "0.00".to_owned(),
    }
}

impl Reference {
    fn of(self, s: &StepSample) -> Vec3 {
        match self {
            Self::Request => s.request.position,
            Self::Tool => s.tool.position,
        }
    }
}

impl Axes {
    fn to_base(self, s: &StepSample, reference: Reference, vector: Vec3) -> Vec3 {
        match (self, reference) {
            (Self::Base(change), _) => change.to_base * vector,
            (Self::Tool, Reference::Request) => s.request.orientation * vector,
            (Self::Tool, Reference::Tool) => s.tool.orientation * vector,
        }
    }
}

/// The pose from which a displacement counts: displacements are executed from where the tool is then.
fn reference_of(s: &StepSample) -> Reference {
    if s.is_step { Reference::Tool } else { Reference::Request }
}

impl Reading {
    /// The position that an answer means.
    fn decode(&self, s: &StepSample) -> Vec3 {
        let answer = s.answered.position_b;
        match self {
            Self::Absolute { scale, axes, offset } => *scale * (axes.to_base * answer) + offset,
            Self::Relative { reference, axes, scale } => {
                reference.of(s) + axes.to_base(s, *reference, *scale * answer)
            }
            Self::Displaced { axes, scale } => {
                let reference = reference_of(s);
                let start = reference.of(s);
                start + axes.to_base(s, reference, *scale * (answer - start))
            }
            Self::Positions => numbers(s).unwrap_or(answer),
            Self::Normalized { scale, offset } => scale.component_mul(&answer) + offset,
            Self::Constant { .. } => answer,
        }
    }

    /// True if the reading explains more than a guess that ignores the answers.
    fn is_informed(&self, steps: &[StepSample], error: f64, spread: f64) -> bool {
        match self {
            Self::Absolute { .. } | Self::Positions | Self::Normalized { .. } => error <= OF_SPREAD * spread,
            Self::Constant { .. } => true,
            Self::Relative { reference, .. } => self.follows(steps, *reference),
            Self::Displaced { .. } => {
                self.follows(steps, steps.first().map_or(Reference::Request, reference_of))
            }
        }
    }

    fn follows(&self, steps: &[StepSample], reference: Reference) -> bool {
        let pair = |s: &StepSample| VectorPair {
            recorded: s.recorded.action.position_b - reference.of(s),
            answered: self.decode(s) - reference.of(s),
        };
        let pairs: Vec<VectorPair> = steps.iter().map(pair).collect();
        correlation(&pairs).is_some_and(|r| r >= EXPLAINS)
    }
}

/// The first numbers of an answer.
fn numbers(s: &StepSample) -> Option<Vec3> {
    s.row.as_deref().and_then(|row| row.get(..3)).map(Vec3::from_column_slice)
}

/// Displacements of all steps in which the tool moves.
pub(super) fn displacements(steps: &[StepSample]) -> Vec<VectorPair> {
    let pair = |s: &StepSample| {
        let start = reference_of(s).of(s);
        VectorPair { recorded: s.recorded.action.position_b - start, answered: s.answered.position_b - start }
    };
    steps.iter().map(pair).filter(|pair| pair.recorded.norm() >= LEAST_TRANSLATION_M).collect()
}

/// Mean distance of answered and recorded positions, m.
fn received_error(steps: &[StepSample]) -> f64 {
    mean(steps.iter().map(|s| (s.answered.position_b - s.recorded.action.position_b).norm()))
}

/// Names what is wrong with translations.
pub(super) fn explain_position(steps: &[StepSample], of: &AnswerAgreement) -> Option<PositionFinding> {
    let before = received_error(steps);
    if let Some(Explanation { reading, error }) = best_reading(steps, before) {
        let evidence = Evidence { before, after: error, unit: " mm", scale: 1e3 };
        return Some(reading.finding(steps, &evidence));
    }
    if of.agrees() || of.n < 10 {
        return None;
    }
    let text = match (of.correlation, of.scale) {
        (Some(r), Some(scale)) if r >= AGREES => lengths(steps, scale, ""),
        _ => "translation: the answers do not follow the demonstrations: check the images (order, flips, size), the \
              axes of chunks (steps first, numbers of an action second), the normalisation of the state, and that the policy was trained on this suite"
            .to_owned(),
    };
    Some(PositionFinding { text, is_other_encoding: false, frame_turn: None })
}

/// The first reading that is about as good as the best, if it is clearly better than the answers as received.
fn best_reading(steps: &[StepSample], before: f64) -> Option<Explanation> {
    if before < LEAST_TRANSLATION_M {
        return None;
    }
    let recorded = |s: &StepSample| s.recorded.action.position_b;
    let center = median_of(steps, recorded);
    let spread = mean(steps.iter().map(|s| (recorded(s) - center).norm()));
    let explain = |reading: Reading| -> Option<Explanation> {
        let error = match &reading {
            Reading::Constant { position } => {
                mean(steps.iter().map(|s| (s.answered.position_b - position).norm()))
            }
            _ => mean(steps.iter().map(|s| (reading.decode(s) - recorded(s)).norm())),
        };
        let is_explained = error <= CLEARLY_BETTER * before && reading.is_informed(steps, error, spread);
        is_explained.then_some(Explanation { reading, error })
    };
    let explained: Vec<Explanation> = readings(steps, spread).into_iter().filter_map(explain).collect();
    let least = explained.iter().map(|one| one.error).fold(f64::INFINITY, f64::min);
    explained.into_iter().find(|one| one.error <= 4.0 / 3.0 * least + TIE_M)
}

fn median_of(steps: &[StepSample], of: impl Fn(&StepSample) -> Vec3) -> Vec3 {
    Vec3::from_fn(|i, _| median(steps.iter().map(|s| of(s)[i])))
}

/// All readings that are considered, the plainest first.
fn readings(steps: &[StepSample], spread: f64) -> Vec<Reading> {
    let mut all = Vec::new();
    let changes = axis_changes();
    let is_step = steps.iter().any(|s| s.is_step);
    if is_step {
        all.push(Reading::Positions);
    } else {
        all.extend(constant(steps, spread));
        absolute_readings(steps, &changes, &mut all);
        relative_readings(steps, &changes, &mut all);
    }
    displaced_readings(steps, &changes, &mut all);
    if !is_step {
        all.extend(moved_readings(steps, &changes));
        all.extend(normalized(steps));
    }
    all
}

/// One position for all steps, if the demonstrations move and the answers do not.
fn constant(steps: &[StepSample], spread: f64) -> Option<Reading> {
    let position = median_of(steps, |s| s.answered.position_b);
    let around = mean(steps.iter().map(|s| (s.answered.position_b - position).norm()));
    (spread > LEAST_OFFSET_M && around < 0.02 * spread).then_some(Reading::Constant { position })
}

/// Units of lengths in m, but m.
const UNITS_M: [(&str, f64); 5] = [
    ("millimetres", 1e-3),
    ("centimetres", 1e-2),
    ("decimetres", 0.1),
    ("inches", 0.0254),
    ("kilometres", 1e3),
];

fn absolute_readings(steps: &[StepSample], changes: &[AxisChange], all: &mut Vec<Reading>) {
    let (own, zero) = (changes[0], Vec3::zeros());
    all.extend(UNITS_M.map(|(_, scale)| Reading::Absolute { scale, axes: own, offset: zero }));
    all.extend(offset_of(steps, 1.0, own));
    all.extend(changes[1..].iter().map(|axes| Reading::Absolute { scale: 1.0, axes: *axes, offset: zero }));
}

/// Positions in a frame that is moved as well.
fn moved_readings(steps: &[StepSample], changes: &[AxisChange]) -> Vec<Reading> {
    let turned = changes[1..].iter().filter_map(|axes| offset_of(steps, 1.0, *axes));
    let of_unit = |(_, scale): (&str, f64)| offset_of(steps, scale, changes[0]);
    let mut all: Vec<Reading> = UNITS_M.into_iter().filter_map(of_unit).chain(turned).collect();
    for (_, scale) in UNITS_M {
        all.extend(changes[1..].iter().map(|axes| Reading::Absolute {
            scale,
            axes: *axes,
            offset: Vec3::zeros(),
        }));
    }
    all
}

/// Positions that are off by a constant.
fn offset_of(steps: &[StepSample], scale: f64, axes: AxisChange) -> Option<Reading> {
    let offset =
        median_of(steps, |s| s.recorded.action.position_b - scale * (axes.to_base * s.answered.position_b));
    (offset.norm() >= LEAST_OFFSET_M).then_some(Reading::Absolute { scale, axes, offset })
}

fn relative_readings(steps: &[StepSample], changes: &[AxisChange], all: &mut Vec<Reading>) {
    for reference in [Reference::Request, Reference::Tool] {
        for axes in [Axes::Base(changes[0]), Axes::Tool] {
            for scale in [1.0, 1e-3] {
                all.push(Reading::Relative { reference, axes, scale });
            }
            let pair = |s: &StepSample| VectorPair {
                recorded: axes.to_base(s, reference, s.answered.position_b),
                answered: s.recorded.action.position_b - reference.of(s),
            };
            let pairs: Vec<VectorPair> = steps.iter().map(pair).collect();
            all.extend(factor(&pairs).map(|scale| Reading::Relative { reference, axes, scale }));
        }
    }
}

/// Displacements in other units or axes: those of the base, those of the tool, then exchanged ones.
fn displaced_readings(steps: &[StepSample], changes: &[AxisChange], all: &mut Vec<Reading>) {
    let others = changes[1..].iter().map(|change| Axes::Base(*change));
    for (k, axes) in [Axes::Base(changes[0]), Axes::Tool].into_iter().chain(others).enumerate() {
        let same = Reading::Displaced { axes, scale: 1.0 };
        let pair = |s: &StepSample| {
            let start = reference_of(s).of(s);
            VectorPair { recorded: same.decode(s) - start, answered: s.recorded.action.position_b - start }
        };
        let pairs: Vec<VectorPair> = steps.iter().map(pair).collect();
        let scale = factor(&pairs).filter(|scale| *scale > 0.0 && !AGREEING_SCALES.contains(scale));
        if k > 0 {
            all.push(same);
        }
        all.extend(scale.map(|scale| Reading::Displaced { axes, scale }));
    }
}

/// Numbers of each axis with a factor and an offset of their own, if each follows the recorded ones.
fn normalized(steps: &[StepSample]) -> Option<Reading> {
    let of_axis = |i: usize| {
        let pair = |s: &StepSample| NumberPair {
            recorded: s.answered.position_b[i],
            answered: s.recorded.action.position_b[i],
        };
        line(&steps.iter().map(pair).collect::<Vec<_>>()).filter(|line| line.correlation >= FOLLOWS)
    };
    let [x, y, z] = [of_axis(0)?, of_axis(1)?, of_axis(2)?];
    Some(Reading::Normalized {
        scale: Vec3::new(x.slope, y.slope, z.slope),
        offset: Vec3::new(x.intercept, y.intercept, z.intercept),
    })
}

impl Reading {
    fn finding(&self, steps: &[StepSample], evidence: &Evidence) -> PositionFinding {
        let is_other_encoding = matches!(self, Self::Relative { .. } | Self::Positions);
        let frame_turn = match self {
            Self::Absolute { axes, .. } if axes.changes > 0 => {
                Some(axes.to_base).filter(|turn| turn.determinant() > 0.0)
            }
            _ => None,
        };
        PositionFinding { text: self.words(steps, evidence), is_other_encoding, frame_turn }
    }

    fn words(&self, steps: &[StepSample], evidence: &Evidence) -> String {
        match self {
            Self::Absolute { scale, axes, offset } => absolute_words(*scale, axes, offset, evidence),
            Self::Relative { reference, axes, scale } => {
                let from = match reference {
                    Reference::Request => "in the observation",
                    Reference::Tool => "at the time of execution",
                };
                let side = if matches!(axes, Axes::Tool) { ", about its own axes" } else { "" };
                let unit = match scale {
                    0.9..1.1 => String::new(),
                    _ => format!(" and in units of {} m", short(*scale)),
                };
                format!(
                    "poses: the answers are relative to the tool pose {from}{side}{unit} ({evidence}): absolute poses in the \
                     frame of the robot's base are expected; add the pose, or use a profile with pose = \"delta\""
                )
            }
            Self::Displaced { axes: Axes::Tool, .. } => format!(
                "translation: the answers move along the axes of the tool ({evidence}): translations are expected along \
                 those of the robot's base"
            ),
            Self::Displaced { axes: Axes::Base(axes), .. } if axes.changes > 0 => axes_words(axes, evidence),
            Self::Displaced { scale, .. } => lengths(steps, 1.0 / scale, &format!(" ({evidence})")),
            Self::Positions => format!(
                "poses: the answers are absolute poses ({evidence}): the profile expects steps relative to the tool; use one \
                 with pose = \"absolute\""
            ),
            Self::Normalized { scale, offset } => format!(
                "translation: each axis of the answers follows the demonstrations with a factor ({}) and an offset ({}) m of \
                 its own ({evidence}): undo the normalisation of the actions",
                listed(scale),
                listed(offset)
            ),
            Self::Constant { position } => format!(
                "translation: every answer commands the same position, ({}) m, with a mean error of {} mm: check the \
                 normalisation of actions and state, and that the server reads the observation",
                listed(position),
                short(1e3 * evidence.before)
            ),
        }
    }
}

fn listed(vector: &Vec3) -> String {
    // Adding 0.0 turns −0.0 into 0.0.
    let [x, y, z] = [vector.x, vector.y, vector.z].map(|x| (1e3 * x).round() / 1e3 + 0.0);
    format!("{x:.3}, {y:.3}, {z:.3}")
}

fn axes_words(axes: &AxisChange, evidence: &Evidence) -> String {
    format!(
        "translation: (x, y, z) of the answers are {} of the demonstrations ({evidence}): use the axes of the robot's base, \
         x forward, y left, z up",
        axes.name()
    )
}

fn absolute_words(scale: f64, axes: &AxisChange, offset: &Vec3, evidence: &Evidence) -> String {
    let unit = UNITS_M.iter().find(|(_, unit)| *unit == scale).map(|(name, _)| *name);
    let is_moved = offset.norm() > 0.0;
    match (unit, axes.changes, is_moved) {
        (None, 0, _) => format!(
            "translation: the answers are off by the constant ({}) m ({evidence}): poses are expected in the frame of the \
             robot's base",
            listed(&-offset)
        ),
        (None, _, false) => axes_words(axes, evidence),
        _ => {
            let units = unit.map_or_else(String::new, |name| format!(" in {name}"));
            let turned = match axes.changes {
                0 => String::new(),
                _ => format!(", whose (x, y, z) are {} of the demonstrations", axes.name()),
            };
            let frame = match is_moved {
                true => format!(" in a frame with its origin at ({}) m of the base{turned}", listed(offset)),
                false => turned,
            };
            format!(
                "translation: the answers look like positions{units}{frame} ({evidence}): metres in the frame of the robot's \
                 base are expected"
            )
        }
    }
}

/// Names a factor of lengths.
fn lengths(steps: &[StepSample], factor: f64, evidence: &str) -> String {
    let step_m = steps.iter().find_map(|s| s.step_m);
    let remedy = match (factor, step_m) {
        (800.0..1250.0, _) => "metres are expected, these look like millimetres".to_owned(),
        (80.0..125.0, _) => "metres are expected, these look like centimetres".to_owned(),
        (0.0008..0.00125, _) => "metres are expected, these look like kilometres".to_owned(),
        (_, Some(step_m)) if (factor / step_m - 1.0).abs() < 0.2 => {
            format!("fractions of {step_m} m are expected, these look like metres")
        }
        _ => {
            "check the scale of the profile's actions, and whether their normalisation was undone".to_owned()
        }
    };
    format!(
        "translation: the answers are {} times as long as the recorded ones{evidence}: {remedy}",
        short(factor)
    )
}
