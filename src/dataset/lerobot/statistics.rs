//! What numbers are like as a whole, in the ten figures that LeRobot keeps of each feature.

use serde::Serialize;

use crate::evaluation::statistics::{quantile, quantile_by};

/// Names of the quantiles, and the quantiles.
pub(super) const QUANTILES: [(&str, f64); 5] =
    [("q01", 0.01), ("q10", 0.10), ("q50", 0.50), ("q90", 0.90), ("q99", 0.99)];

/// Extremes, mean and spread of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RunningMoments {
    count: f64,
    min: f64,
    max: f64,
    mean: f64,
    /// Sum of the squared distances from the mean.
    squares: f64,
}

impl RunningMoments {
    /// Of no numbers.
    const NONE: Self =
        Self { count: 0.0, min: f64::INFINITY, max: f64::NEG_INFINITY, mean: 0.0, squares: 0.0 };

    /// Of numbers that each stand for as many as is said: in two passes, so that what never changes has no spread at all.
    fn weighted(numbers: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let mut all = Self::NONE;
        let mut sum = 0.0;
        for (x, weight) in numbers.clone() {
            all.count += weight;
            all.min = all.min.min(x);
            all.max = all.max.max(x);
            sum += weight * x;
        }
        if all.count > 0.0 {
            // Rounding must not push the mean of equal numbers beyond them.
            all.mean = (sum / all.count).clamp(all.min, all.max);
            all.squares = numbers.map(|(x, weight)| weight * (x - all.mean).powi(2)).sum();
        }
        all
    }

    /// Of numbers.
    pub(super) fn of(numbers: impl Iterator<Item = f64> + Clone) -> Self {
        Self::weighted(numbers.map(|x| (x, 1.0)))
    }

    /// Of these and the others (Chan, Golub and LeVeque 1979).
    pub(super) fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        if other.count == 0.0 {
            return;
        }
        let apart = other.mean - self.mean;
        let share = other.count / count;
        self.squares += other.squares + apart * apart * self.count * share;
        self.mean += apart * share;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.count = count;
    }

    fn deviation(&self) -> f64 {
        (self.squares / self.count.max(1.0)).sqrt()
    }

    /// Of all numbers of several.
    pub(super) fn together<'a>(all: impl Iterator<Item = &'a Self>) -> Self {
        all.fold(Self::NONE, |mut sum, one| {
            sum.merge(one);
            sum
        })
    }
}

/// How often each of evenly spaced numbers from zero on occurs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ValueCounts {
    step: f64,
    counts: Vec<u64>,
}

impl ValueCounts {
    /// Empty, with `bins` numbers `step` apart.
    pub(super) fn new(step: f64, bins: usize) -> Self {
        Self { step, counts: vec![0; bins] }
    }

    /// Counts the number with an index.
    pub(super) fn count(&mut self, bin: usize) {
        self.counts[bin] += 1;
    }

    /// Counts the number that is nearest.
    pub(super) fn count_nearest(&mut self, x: f64) {
        // Casts saturate: what is below is counted as the first.
        let bin = (x / self.step).round() as usize;
        let last = self.counts.len() - 1;
        self.counts[bin.min(last)] += 1;
    }

    fn numbers(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        let seen = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        seen.map(|(bin, count)| (bin as f64 * self.step, *count as f64))
    }

    /// The number at a place in their order.
    fn at(&self, place: u64) -> f64 {
        let mut before = 0;
        let bin = self.counts.iter().position(|count| {
            before += count;
            before > place
        });
        bin.unwrap_or(self.counts.len() - 1) as f64 * self.step
    }
}

/// What quantiles are taken from.
#[derive(Clone, Debug, PartialEq)]
enum ColumnStatistics {
    /// None are.
    None,
    /// All the numbers.
    All(Vec<f64>),
    /// How often each occurs.
    ValueCounts(ValueCounts),
}

/// Numbers as a whole.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ValueStatistics {
    moments: RunningMoments,
    spread: ColumnStatistics,
}

impl ValueStatistics {
    /// Of numbers that are kept.
    pub(super) fn of(numbers: Vec<f64>) -> Self {
        Self { moments: RunningMoments::of(numbers.iter().copied()), spread: ColumnStatistics::All(numbers) }
    }

    /// Of numbers that were counted, all of which are among those of the tally.
    pub(super) fn counted(tally: ValueCounts) -> Self {
        Self {
            moments: RunningMoments::weighted(tally.numbers()),
            spread: ColumnStatistics::ValueCounts(tally),
        }
    }

    /// Of numbers whose quantiles are taken from those nearest to them in a tally.
    pub(super) fn near(moments: RunningMoments, tally: ValueCounts) -> Self {
        Self { moments, spread: ColumnStatistics::ValueCounts(tally) }
    }

    /// Without quantiles.
    pub(super) fn bare(moments: RunningMoments) -> Self {
        Self { moments, spread: ColumnStatistics::None }
    }

    /// Of these and the others, which are kept in the same way.
    pub(super) fn merge(&mut self, other: &Self) {
        self.moments.merge(&other.moments);
        match (&mut self.spread, &other.spread) {
            (ColumnStatistics::All(numbers), ColumnStatistics::All(more)) => numbers.extend(more),
            (ColumnStatistics::ValueCounts(tally), ColumnStatistics::ValueCounts(more)) => {
                tally.counts.iter_mut().zip(&more.counts).for_each(|(count, more)| *count += more);
            }
            _ => {}
        }
    }

    /// Quantiles as [`QUANTILES`]: linear between neighbours, as numpy takes them. None if they are not kept.
    fn quantiles(&self) -> Option<[f64; 5]> {
        match &self.spread {
            ColumnStatistics::None => None,
            ColumnStatistics::All(numbers) => {
                let mut sorted = numbers.clone();
                sorted.sort_by(f64::total_cmp);
                Some(QUANTILES.map(|(_, q)| quantile(&sorted, q).unwrap_or(f64::NAN)))
            }
            ColumnStatistics::ValueCounts(tally) => {
                let count = self.moments.count as usize;
                let at = |rank: usize| tally.at(rank as u64);
                Some(QUANTILES.map(|(_, q)| quantile_by(count, at, q).unwrap_or(f64::NAN)))
            }
        }
    }
}

/// A feature as a whole: a summary of each of its numbers, in the order of `shape`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FeatureStatistics {
    /// Its name.
    pub name: &'static str,
    /// Shape of each figure.
    pub shape: Vec<usize>,
    /// Steps it is of.
    pub steps: u64,
    /// The parts.
    pub parts: Vec<ValueStatistics>,
}

/// The figures of a feature.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Figures {
    /// Name of the feature.
    pub name: &'static str,
    /// Shape of each figure.
    pub shape: Vec<usize>,
    /// Steps it is of.
    pub steps: u64,
    /// `min`, `max`, `mean`, `std`, and, where they are kept, quantiles, each of `shape`.
    pub figures: Vec<(&'static str, Vec<f64>)>,
}

impl FeatureStatistics {
    /// Takes more steps in.
    pub(super) fn merge(&mut self, other: &Self) {
        self.steps += other.steps;
        self.parts.iter_mut().zip(&other.parts).for_each(|(part, more)| part.merge(more));
    }

    /// The figures, with or without quantiles.
    pub(super) fn figures(&self, quantiles: bool) -> Figures {
        let each =
            |pick: fn(&RunningMoments) -> f64| self.parts.iter().map(|part| pick(&part.moments)).collect();
        let mut figures = vec![
            ("min", each(|m| m.min)),
            ("max", each(|m| m.max)),
            ("mean", each(|m| m.mean)),
            ("std", each(RunningMoments::deviation)),
        ];
        let kept = self.parts.iter().map(ValueStatistics::quantiles).collect::<Option<Vec<[f64; 5]>>>();
        if let Some(kept) = kept.filter(|_| quantiles) {
            let named = QUANTILES.iter().enumerate();
            figures.extend(named.map(|(at, (name, _))| (*name, kept.iter().map(|part| part[at]).collect())));
        }
        Figures { name: self.name, shape: self.shape.clone(), steps: self.steps, figures }
    }
}

/// Numbers as nested lists.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum NestedList {
    /// Whole.
    Whole(u64),
    /// A number.
    Number(f64),
    /// A number in as many digits as single precision needs.
    Single(f32),
    /// A list.
    List(Vec<NestedList>),
}

impl NestedList {
    /// Numbers in a shape.
    pub(super) fn new(numbers: &[f64], shape: &[usize], leaf: fn(f64) -> Self) -> Self {
        let Some((first, rest)) = shape.split_first() else {
            return leaf(numbers.first().copied().unwrap_or_default());
        };
        let part = numbers.len() / (*first).max(1);
        Self::List(numbers.chunks(part.max(1)).map(|chunk| Self::new(chunk, rest, leaf)).collect())
    }
}

impl Figures {
    /// As JSON has them: figures by name, and `count`.
    pub(super) fn nested(&self, leaf: fn(f64) -> NestedList) -> Vec<(&'static str, NestedList)> {
        let count = ("count", NestedList::List(vec![NestedList::Whole(self.steps)]));
        let figures = self.figures.iter();
        figures
            .map(|(name, numbers)| (*name, NestedList::new(numbers, &self.shape, leaf)))
            .chain([count])
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn figures(summary: ValueStatistics) -> Vec<f64> {
        let all = FeatureStatistics { name: "x", shape: vec![1], steps: 1, parts: vec![summary] };
        all.figures(true).figures.into_iter().map(|(_, numbers)| numbers[0]).collect()
    }

    #[test]
    fn figures_are_those_that_numpy_gives() {
        // numpy.quantile([3, 1, 2, 10], [.01, .1, .5, .9, .99]), min, max, mean and std.
        let expected = [1.0, 10.0, 4.0, 3.535533905932738, 1.03, 1.3, 2.5, 7.9, 9.79];
        let found = figures(ValueStatistics::of(vec![3.0, 1.0, 2.0, 10.0]));
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        let still = figures(ValueStatistics::of(vec![0.1; 7]));
        assert_eq!(still, [0.1, 0.1, 0.1, 0.0, 0.1, 0.1, 0.1, 0.1, 0.1]);
    }

    proptest! {
        #[test]
        fn counted_numbers_have_the_figures_of_numbers_that_are_kept(bytes in prop::collection::vec(0_u8.., 1..300)) {
            let mut tally = ValueCounts::new(1.0 / 255.0, 256);
            bytes.iter().for_each(|byte| tally.count(usize::from(*byte)));
            let kept = figures(ValueStatistics::of(bytes.iter().map(|byte| f64::from(*byte) / 255.0).collect()));
            let counted = figures(ValueStatistics::counted(tally));
            prop_assert!(kept.iter().zip(&counted).all(|(a, b)| (a - b).abs() < 1e-12), "{kept:?} {counted:?}");
        }

        #[test]
        fn parts_together_have_the_figures_of_the_whole(
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
    fn numbers_are_nested_in_the_order_of_their_shape() {
        let numbers: Vec<f64> = (0..6).map(f64::from).collect();
        let nested =
            serde_json::to_string(&NestedList::new(&numbers, &[3, 1, 2], NestedList::Number)).unwrap();
        assert_eq!(nested, "[[[0.0,1.0]],[[2.0,3.0]],[[4.0,5.0]]]");
        assert_eq!(serde_json::to_string(&NestedList::Single(0.1)).unwrap(), "0.1");
    }
}
