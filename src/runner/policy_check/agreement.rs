//! How far answers agree with recorded actions, and the measures of other readings of them.

use serde::Serialize;

use softvt_common::text::AXIS_NAMES;
use softvt_evaluation::statistics::quantile;
use softvt_geometry::{Mat3, Vec3};

/// Correlation above which answers and recorded actions agree.
pub(super) const AGREES: f64 = 0.5;
/// Correlation above which another reading of the answers explains them.
pub(super) const EXPLAINS: f64 = 0.7;
/// Share of the error that another reading may leave to explain the answers.
pub(super) const CLEARLY_BETTER: f64 = 0.5;
/// Share of the spread of the recorded values that another reading may leave.
pub(super) const OF_SPREAD: f64 = 0.35;
/// Factors between answers and recorded actions that agree.
pub(super) const AGREEING_SCALES: std::ops::RangeInclusive<f64> = 0.4..=2.5;

/// How far answers agree with recorded actions in one respect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AnswerAgreement {
    /// Number of control steps that were compared.
    pub n: usize,
    /// Correlation of the displacements, from −1 to 1; null without motion.
    pub correlation: Option<f64>,
    /// Factor from the recorded displacement to the answered one.
    pub scale: Option<f64>,
    /// Median distance of answered and recorded action: m, rad, or closure.
    pub error: Option<f64>,
}

/// A recorded displacement and the answered one.
#[derive(Clone, Copy, Debug)]
pub(super) struct VectorPair {
    pub recorded: Vec3,
    pub answered: Vec3,
}

/// A recorded number and the answered one.
#[derive(Clone, Copy, Debug)]
pub(super) struct NumberPair {
    pub recorded: f64,
    pub answered: f64,
}

/// The line through pairs: `answered = slope · recorded + intercept`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub correlation: f64,
    pub slope: f64,
    pub intercept: f64,
}

impl AnswerAgreement {
    pub(super) fn of_vectors(pairs: &[VectorPair]) -> Self {
        let mut errors: Vec<f64> = pairs.iter().map(|p| (p.answered - p.recorded).norm()).collect();
        errors.sort_by(f64::total_cmp);
        Self {
            n: pairs.len(),
            correlation: correlation(pairs),
            scale: factor(pairs),
            error: quantile(&errors, 0.5),
        }
    }

    pub(super) fn of_numbers(pairs: &[NumberPair]) -> Self {
        let line = line(pairs);
        let mut errors: Vec<f64> = pairs.iter().map(|pair| (pair.answered - pair.recorded).abs()).collect();
        errors.sort_by(f64::total_cmp);
        Self {
            n: pairs.len(),
            correlation: line.map(|line| line.correlation),
            scale: line.map(|line| line.slope),
            error: quantile(&errors, 0.5),
        }
    }

    pub(super) fn agrees(&self) -> bool {
        self.correlation.is_none_or(|r| r >= AGREES)
            && self.scale.is_none_or(|s| AGREEING_SCALES.contains(&s))
    }
}

fn sum(pairs: &[VectorPair], of: impl Fn(&VectorPair) -> f64) -> f64 {
    pairs.iter().map(of).sum()
}

/// Correlation of displacements about zero; `None` without motion.
pub(super) fn correlation(pairs: &[VectorPair]) -> Option<f64> {
    let power = sum(pairs, |p| p.recorded.norm_squared()) * sum(pairs, |p| p.answered.norm_squared());
    (power > 0.0).then(|| sum(pairs, |p| p.answered.dot(&p.recorded)) / power.sqrt())
}

/// Factor from the recorded displacements to the answered ones.
pub(super) fn factor(pairs: &[VectorPair]) -> Option<f64> {
    let recorded = sum(pairs, |p| p.recorded.norm_squared());
    (recorded > 0.0).then(|| sum(pairs, |p| p.answered.dot(&p.recorded)) / recorded)
}

/// The line of least squares; `None` if either side is constant.
pub(super) fn line(pairs: &[NumberPair]) -> Option<Line> {
    let n = pairs.len() as f64;
    let mean = |of: &dyn Fn(&NumberPair) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let (recorded, answered) = (mean(&|p| p.recorded), mean(&|p| p.answered));
    let recorded_power = mean(&|p| (p.recorded - recorded).powi(2));
    let answered_power = mean(&|p| (p.answered - answered).powi(2));
    let both = mean(&|p| (p.recorded - recorded) * (p.answered - answered));
    // Rounding of a constant is no variation.
    let is_constant = |power: f64, mean: f64| power.sqrt() <= 1e-9 * (1.0 + mean.abs());
    (!pairs.is_empty() && !is_constant(recorded_power, recorded) && !is_constant(answered_power, answered))
        .then(|| Line {
            correlation: both / (recorded_power * answered_power).sqrt(),
            slope: both / recorded_power,
            intercept: answered - both / recorded_power * recorded,
        })
}

/// Mean of numbers; 0 without any.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut count, mut sum) = (0_usize, 0.0);
    for value in values {
        count += 1;
        sum += value;
    }
    sum / count.max(1) as f64
}

/// Median of numbers; 0 without any.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5).unwrap_or(0.0)
}

/// A way to exchange and reverse axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisChange {
    /// From the answered axes to those of the base.
    pub to_base: Mat3,
    /// Number of axes that change.
    pub changes: usize,
}

/// All 48 ways in which axes can be exchanged and reversed; that without a change comes first, and the fewer axes
/// change the earlier.
pub(super) fn axis_changes() -> Vec<AxisChange> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let of = |order: [usize; 3], signs: usize| {
        let to_base = Mat3::from_fn(|row, column| match (order[row] == column, signs >> row & 1) {
            (false, _) => 0.0,
            (true, 0) => 1.0,
            (true, _) => -1.0,
        });
        AxisChange { to_base, changes: (0..3).filter(|i| to_base[(*i, *i)] != 1.0).count() }
    };
    let mut all: Vec<AxisChange> =
        ORDERS.into_iter().flat_map(|order| (0..8).map(move |signs| of(order, signs))).collect();
    all.sort_by_key(|change| change.changes);
    all
}

impl AxisChange {
    /// The axes of the demonstrations that the answers have as x, y and z.
    pub(super) fn name(&self) -> String {
        let name = |answered: usize| {
            let row = (0..3).find(|row| self.to_base[(*row, answered)] != 0.0).unwrap_or(answered);
            let sign = if self.to_base[(row, answered)] < 0.0 { "−" } else { "" };
            format!("{sign}{}", AXIS_NAMES[row])
        };
        format!("({}, {}, {})", name(0), name(1), name(2))
    }
}
