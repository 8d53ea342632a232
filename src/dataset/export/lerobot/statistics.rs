//! The statistics that LeRobot stores per feature: count, extremes, mean, standard deviation and quantiles.

use serde::Serialize;

use softvt_evaluation::statistics::{quantile, quantile_by};

/// The quantiles and their names.
const QUANTILES: [f64; 5] = [0.01, 0.10, 0.50, 0.90, 0.99];
const QUANTILE_NAMES: [&str; 5] = ["q01", "q10", "q50", "q90", "q99"];

/// Count, extremes, mean and sum of squared deviations of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ValueMoments {
    count: f64,
    min: f64,
    max: f64,
    mean: f64,
    squared_deviations: f64,
}

impl ValueMoments {
    const EMPTY: Self =
        Self { count: 0.0, min: f64::INFINITY, max: f64::NEG_INFINITY, mean: 0.0, squared_deviations: 0.0 };

    /// Moments of (number, multiplicity) pairs. Two passes, so that constant numbers have a deviation of exactly 0.
    fn weighted(numbers: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let mut all = Self::EMPTY;
        let mut sum = 0.0;
        for (x, weight) in numbers.clone() {
            all.count += weight;
            all.min = all.min.min(x);
            all.max = all.max.max(x);
            sum += weight * x;
        }
        if all.count > 0.0 {
            // Rounding must not move the mean of equal numbers away from them.
            all.mean = (sum / all.count).clamp(all.min, all.max);
            all.squared_deviations = numbers.map(|(x, weight)| weight * (x - all.mean).powi(2)).sum();
        }
        all
    }

    pub(super) fn of(numbers: impl Iterator<Item = f64> + Clone) -> Self {
        Self::weighted(numbers.map(|x| (x, 1.0)))
    }

    /// Combines two sets (Chan, Golub and LeVeque 1979).
    pub(super) fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        if other.count == 0.0 {
            return;
        }
        let difference = other.mean - self.mean;
        let share = other.count / count;
        self.squared_deviations += other.squared_deviations + difference * difference * self.count * share;
        self.mean += difference * share;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.count = count;
    }

    pub(super) fn merged<'a>(all: impl Iterator<Item = &'a Self>) -> Self {
        let mut sum = Self::EMPTY;
        all.for_each(|one| sum.merge(one));
        sum
    }
}

/// Histogram of the numbers 0, `step`, 2 `step`, …
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ValueCounts {
    step: f64,
    counts: Vec<u64>,
}

impl ValueCounts {
    pub(super) fn new(step: f64, bins: usize) -> Self {
        Self { step, counts: vec![0; bins] }
    }

    /// Counts the number `bin · step`.
    pub(super) fn count(&mut self, bin: usize) {
        self.counts[bin] += 1;
    }

    pub(super) fn count_nearest(&mut self, x: f64) {
        // The cast saturates at 0.
        let bin = (x / self.step).round() as usize;
        let last = self.counts.len() - 1;
        self.counts[bin.min(last)] += 1;
    }

    fn numbers(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        let seen = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        seen.map(|(bin, count)| (bin as f64 * self.step, *count as f64))
    }

    /// The number at a rank in ascending order.
    fn at_rank(&self, rank: u64) -> f64 {
        let mut before = 0;
        let bin = self.counts.iter().position(|count| {
            before += count;
            before > rank
        });
        bin.unwrap_or(self.counts.len() - 1) as f64 * self.step
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum QuantileSource {
    None,
    All(Vec<f64>),
    Counts(ValueCounts),
}

/// Statistics of a set of numbers. The quantiles may be those of rounded numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ValueStatistics {
    pub moments: ValueMoments,
    pub quantile_source: QuantileSource,
}

impl ValueStatistics {
    /// Exact statistics; keeps the numbers.
    pub(super) fn of(numbers: Vec<f64>) -> Self {
        let moments = ValueMoments::of(numbers.iter().copied());
        Self { moments, quantile_source: QuantileSource::All(numbers) }
    }

    /// Exact statistics of counted numbers.
    pub(super) fn counted(counts: ValueCounts) -> Self {
        let moments = ValueMoments::weighted(counts.numbers());
        Self { moments, quantile_source: QuantileSource::Counts(counts) }
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.moments.merge(&other.moments);
        match (&mut self.quantile_source, &other.quantile_source) {
            (QuantileSource::All(numbers), QuantileSource::All(more)) => numbers.extend(more),
            (QuantileSource::Counts(counts), QuantileSource::Counts(more)) => {
                counts.counts.iter_mut().zip(&more.counts).for_each(|(count, more)| *count += more);
            }
            _ => {}
        }
    }

    /// [`QUANTILES`] with linear interpolation, as in numpy; `None` if they are not requested.
    fn quantiles(&self) -> Option<[f64; 5]> {
        match &self.quantile_source {
            QuantileSource::None => None,
            QuantileSource::All(numbers) => {
                let mut sorted = numbers.clone();
                sorted.sort_by(f64::total_cmp);
                Some(QUANTILES.map(|q| quantile(&sorted, q).unwrap_or(f64::NAN)))
            }
            QuantileSource::Counts(counts) => {
                let count = self.moments.count as usize;
                let at = |rank: usize| counts.at_rank(rank as u64);
                Some(QUANTILES.map(|q| quantile_by(count, at, q).unwrap_or(f64::NAN)))
            }
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct FeatureStatistics {
    pub name: &'static str,
    /// Shape of each figure.
    pub shape: Vec<usize>,
    pub steps: u64,
    /// Statistics of each number, in the order of `shape`.
    pub parts: Vec<ValueStatistics>,
}

/// One statistic of a feature, with a value for each number of its shape.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Figure {
    pub name: &'static str,
    pub values: Vec<f64>,
}

impl FeatureStatistics {
    pub(super) fn merge(&mut self, other: &Self) {
        self.steps += other.steps;
        self.parts.iter_mut().zip(&other.parts).for_each(|(part, more)| part.merge(more));
    }

    /// `min`, `max`, `mean`, `std` and, if requested and available, quantiles.
    pub(super) fn figures(&self, with_quantiles: bool) -> Vec<Figure> {
        let figure = |name, value: fn(&ValueMoments) -> f64| Figure {
            name,
            values: self.parts.iter().map(|part| value(&part.moments)).collect(),
        };
        let mut figures = vec![
            figure("min", |m| m.min),
            figure("max", |m| m.max),
            figure("mean", |m| m.mean),
            figure("std", |m| (m.squared_deviations / m.count.max(1.0)).sqrt()),
        ];
        let quantiles = self.parts.iter().map(ValueStatistics::quantiles).collect::<Option<Vec<[f64; 5]>>>();
        if let Some(quantiles) = quantiles.filter(|_| with_quantiles) {
            let column = |at: usize| quantiles.iter().map(|part| part[at]).collect();
            let names = QUANTILE_NAMES.into_iter().enumerate();
            figures.extend(names.map(|(at, name)| Figure { name, values: column(at) }));
        }
        figures
    }

    /// The figures by name in LeRobot's form, nested lists, and `count`.
    pub(super) fn nested(
        &self,
        with_quantiles: bool,
        leaf: fn(f64) -> NestedList,
    ) -> Vec<(&'static str, NestedList)> {
        let nest = |figure: Figure| (figure.name, NestedList::new(&figure.values, &self.shape, leaf));
        let count = ("count", NestedList::List(vec![NestedList::Whole(self.steps)]));
        self.figures(with_quantiles).into_iter().map(nest).chain([count]).collect()
    }
}

/// Numbers in nested lists, as in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum NestedList {
    Whole(u64),
    Number(f64),
    /// Written with the digits of single precision.
    Single(f32),
    List(Vec<NestedList>),
}

impl NestedList {
    /// Arranges numbers in row-major order into lists of `shape`.
    pub(super) fn new(numbers: &[f64], shape: &[usize], leaf: fn(f64) -> Self) -> Self {
        let Some((first, rest)) = shape.split_first() else {
            return leaf(numbers.first().copied().unwrap_or_default());
        };
        let part = numbers.len() / (*first).max(1);
        Self::List(numbers.chunks(part.max(1)).map(|chunk| Self::new(chunk, rest, leaf)).collect())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn figures(summary: ValueStatistics) -> Vec<f64> {
        let all = FeatureStatistics { name: "x", shape: vec![1], steps: 1, parts: vec![summary] };
        all.figures(true).into_iter().map(|figure| figure.values[0]).collect()
    }

    #[test]
    fn figures_agree_with_numpy() {
        // numpy.quantile([3, 1, 2, 10], [.01, .1, .5, .9, .99]), min, max, mean and std.
        let expected = [1.0, 10.0, 4.0, 3.535533905932738, 1.03, 1.3, 2.5, 7.9, 9.79];
        let found = figures(ValueStatistics::of(vec![3.0, 1.0, 2.0, 10.0]));
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        let still = figures(ValueStatistics::of(vec![0.1; 7]));
        assert_eq!(still, [0.1, 0.1, 0.1, 0.0, 0.1, 0.1, 0.1, 0.1, 0.1]);
    }

    proptest! {
        #[test]
        fn counted_numbers_have_the_same_figures(bytes in prop::collection::vec(0_u8.., 1..300)) {
            let mut counts = ValueCounts::new(1.0 / 255.0, 256);
            bytes.iter().for_each(|byte| counts.count(usize::from(*byte)));
            let kept = figures(ValueStatistics::of(bytes.iter().map(|byte| f64::from(*byte) / 255.0).collect()));
            let counted = figures(ValueStatistics::counted(counts));
            prop_assert!(kept.iter().zip(&counted).all(|(a, b)| (a - b).abs() < 1e-12), "{kept:?} {counted:?}");
        }

        #[test]
        fn merged_parts_have_the_figures_of_the_whole(
            numbers in prop::collection::vec(-1e3..1e3_f64, 2..200), cut in 0.0..1.0,
        ) {
            let cut = (cut * numbers.len() as f64) as usize;
            let mut parts = ValueStatistics::of(numbers[..cut].to_vec());
            parts.merge(&ValueStatistics::of(numbers[cut..].to_vec()));
            let (parts, whole) = (figures(parts), figures(ValueStatistics::of(numbers)));
            prop_assert!(parts.iter().zip(&whole).all(|(a, b)| (a - b).abs() < 1e-8), "{parts:?} {whole:?}");
        }
    }

    #[test]
    fn numbers_are_nested_in_row_major_order() {
        let numbers: Vec<f64> = (0..6).map(f64::from).collect();
        let nested =
            serde_json::to_string(&NestedList::new(&numbers, &[3, 1, 2], NestedList::Number)).unwrap();
        assert_eq!(nested, "[[[0.0,1.0]],[[2.0,3.0]],[[4.0,5.0]]]");
        assert_eq!(serde_json::to_string(&NestedList::Single(0.1)).unwrap(), "0.1");
    }
}
