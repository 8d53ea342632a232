//! Rates with confidence intervals, means and quantiles.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use serde::Serialize;

/// Quantile of the normal distribution for a two-sided 95 % interval.
pub const Z95: f64 = 1.959_963_984_540_054;

/// Share of episodes with its uncertainty, in percent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Rate {
    /// Number of episodes that were counted.
    #[serde(skip)]
    pub count: usize,
    /// Number of episodes; 0 for what was never judged.
    #[serde(skip)]
    pub total: usize,
    /// Share, %; null without episodes.
    pub rate: Option<f64>,
    /// 95 % Wilson score interval of the share, %; null without episodes.
    pub wilson95: Option<[f64; 2]>,
    /// 95 % interval of the share by [`stratified_bootstrap`] over tasks, %; absent where it is not computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap95: Option<[f64; 2]>,
}

impl Rate {
    /// Rate of `count` in `total`.
    pub fn new(count: usize, total: usize) -> Self {
        let rate = (total > 0).then(|| 100.0 * count as f64 / total as f64);
        Self { count, total, rate, wilson95: wilson95(count, total), bootstrap95: None }
    }

    /// The rate of what was never judged: null.
    pub fn not_judged() -> Self {
        Self::default()
    }

    /// Adds the bootstrap interval; `strata` are the outcomes by task.
    pub fn with_bootstrap(self, strata: &[Vec<bool>]) -> Self {
        let percent =
            |outcomes: &Vec<bool>| outcomes.iter().map(|held| if *held { 100.0 } else { 0.0 }).collect();
        let strata: Vec<Vec<f64>> = strata.iter().map(percent).collect();
        Self { bootstrap95: self.rate.and_then(|_| stratified_bootstrap(&strata)), ..self }
    }

    /// Rate of the `items` for which `test` holds.
    pub fn from_test<T>(items: &[T], test: impl Fn(&T) -> bool) -> Self {
        Self::new(items.iter().filter(|item| test(item)).count(), items.len())
    }
}

/// 95 % Wilson score interval (Wilson, 1927) of `count` successes in `total` trials, in percent; `None` without trials.
fn wilson95(count: usize, total: usize) -> Option<[f64; 2]> {
    if total == 0 {
        return None;
    }
    let (n, p) = (total as f64, count as f64 / total as f64);
    let z2 = Z95 * Z95;
    let centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z95 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    // At the ends the interval reaches 0 and 100 exactly; do not leave a rounding error there.
    let low = if count == 0 { 0.0 } else { 100.0 * (centre - half) };
    let high = if count == total { 100.0 } else { 100.0 * (centre + half) };
    Some([low, high])
}

/// Number of resamples of a bootstrap.
const RESAMPLES: usize = 4000;
/// Smallest number of values of a bootstrap interval. With fewer the interval is little more than their range.
pub const MIN_BOOTSTRAP_VALUES: usize = 10;
/// Smallest number of values per stratum: resampling within n values underestimates their variance by the factor
/// (n − 1)/n.
pub const MIN_STRATUM_VALUES: usize = 5;

/// 95 % interval of the mean of all values by the percentile bootstrap (Efron, 1979), resampled within each stratum.
///
/// `None` for fewer than [`MIN_BOOTSTRAP_VALUES`] values, or fewer than [`MIN_STRATUM_VALUES`] in a stratum that has
/// any. The seed is the number of values, so equal data give equal intervals.
pub fn stratified_bootstrap(strata: &[Vec<f64>]) -> Option<[f64; 2]> {
    let strata: Vec<&Vec<f64>> = strata.iter().filter(|values| !values.is_empty()).collect();
    let n: usize = strata.iter().map(|values| values.len()).sum();
    if n < MIN_BOOTSTRAP_VALUES || strata.iter().any(|values| values.len() < MIN_STRATUM_VALUES) {
        return None;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(n as u64);
    let mut resampled = |values: &[f64]| -> f64 {
        // Equal values need no resampling.
        if values.iter().all(|value| *value == values[0]) {
            return values[0] * values.len() as f64;
        }
        let draw = |_| values[((rng.next_u64() >> 32) as usize * values.len()) >> 32];
        (0..values.len()).map(draw).sum()
    };
    let mut means: Vec<f64> = (0..RESAMPLES)
        .map(|_| strata.iter().map(|values| resampled(values)).sum::<f64>() / n as f64)
        .collect();
    means.sort_by(f64::total_cmp);
    quantile(&means, 0.025).zip(quantile(&means, 0.975)).map(|(low, high)| [low, high])
}

/// Arithmetic mean; `None` of an empty slice.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Quantile of `sorted` values at `q` in 0 to 1: linear between order statistics (type 7 of Hyndman and Fan, 1996;
/// numpy's default). `None` of an empty slice.
pub fn quantile(sorted: &[f64], q: f64) -> Option<f64> {
    quantile_by(sorted.len(), |rank| sorted[rank], q)
}

/// As [`quantile`], of `count` values of which `at(rank)` returns the one at a rank from 0 to `count − 1`.
pub fn quantile_by(count: usize, at: impl Fn(usize) -> f64, q: f64) -> Option<f64> {
    let last = count.checked_sub(1)?;
    let place = q.clamp(0.0, 1.0) * last as f64;
    let (rank, share) = (place.floor() as usize, place.fract());
    let low = at(rank);
    if share == 0.0 {
        return Some(low);
    }
    Some(low + share * (at((rank + 1).min(last)) - low))
}

/// Mean and quantiles of a quantity.
///
/// Invalid episodes have no value that could be averaged; they rank above all values, as +∞. A percentile that falls on
/// one of them is null. All are null without values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distribution {
    /// Arithmetic mean of the values.
    pub mean: Option<f64>,
    /// 5th percentile of the values.
    pub p5: Option<f64>,
    /// Median (50th percentile).
    pub median: Option<f64>,
    /// 95th percentile of the values.
    pub p95: Option<f64>,
    /// Number of values, which the mean is over; 0 of an empty list.
    pub n: usize,
    /// Number of invalid episodes, which rank above all values.
    pub invalid: usize,
    /// 95 % interval of the mean by [`stratified_bootstrap`] over tasks; absent where it is not computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap95: Option<[f64; 2]>,
}

impl Distribution {
    /// Distribution of `values`, which must be finite.
    pub fn from_values(values: Vec<f64>) -> Self {
        Self::with_invalid(values, 0)
    }

    /// Distribution of `values`, which must be finite, and of `invalid` episodes that rank above them.
    pub fn with_invalid(mut values: Vec<f64>, invalid: usize) -> Self {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let ranked = |rank: usize| values.get(rank).copied().unwrap_or(f64::INFINITY);
        let percentile = |q| quantile_by(n + invalid, ranked, q).filter(|value| value.is_finite());
        Self {
            mean: mean(&values),
            p5: percentile(0.05),
            median: percentile(0.5),
            p95: percentile(0.95),
            n,
            invalid,
            bootstrap95: None,
        }
    }

    /// True if there are invalid episodes. Percentiles that are null fall on them.
    pub fn has_invalid(&self) -> bool {
        self.invalid > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_solves_its_defining_equation() {
        for (count, total) in [(1, 7), (30, 500), (499, 500)] {
            let p = count as f64 / total as f64;
            for bound in wilson95(count, total).unwrap() {
                let q = bound / 100.0;
                let z = (p - q).abs() / (q * (1.0 - q) / total as f64).sqrt();
                assert!((z - Z95).abs() < 1e-9, "{count}/{total}: z {z}");
            }
        }
        let [low, high] = wilson95(49, 50).unwrap();
        assert!((low - 89.504_556).abs() < 1e-6 && (high - 99.646_074).abs() < 1e-6, "{low} {high}");
        assert_eq!((wilson95(50, 50).unwrap()[1], wilson95(0, 10).unwrap()[0]), (100.0, 0.0));
        assert_eq!(wilson95(0, 0), None);
    }

    #[test]
    fn quantiles_interpolate_as_numpy_does() {
        let values = [1.0, 2.0, 4.0, 8.0];
        assert_eq!(quantile(&values, 0.0), Some(1.0));
        assert_eq!(quantile(&values, 0.5), Some(3.0));
        assert!((quantile(&values, 0.95).unwrap() - 7.4).abs() < 1e-12);
        assert!((quantile(&values, 0.05).unwrap() - 1.15).abs() < 1e-12);
        assert_eq!(quantile(&values, 1.0), Some(8.0));
        assert_eq!(quantile(&[3.0], 0.95), Some(3.0));
        assert_eq!(quantile(&[], 0.5), None);
    }

    #[test]
    fn a_distribution_does_not_depend_on_the_order() {
        let a = Distribution::from_values(vec![3.0, 1.0, 2.0]);
        assert_eq!(a, Distribution::from_values(vec![1.0, 2.0, 3.0]));
        assert_eq!((a.mean, a.median, a.n), (Some(2.0), Some(2.0), 3));
        assert_eq!(Distribution::from_values(vec![]), Distribution::default());
    }

    #[test]
    fn invalid_episodes_rank_above_all_values() {
        // Ranks 0 to 4: 1, 2, 3, ∞, ∞.
        let d = Distribution::with_invalid(vec![3.0, 1.0, 2.0], 2);
        assert_eq!((d.mean, d.median, d.p95, d.n, d.invalid), (Some(2.0), Some(3.0), None, 3, 2));
        assert!((d.p5.unwrap() - 1.2).abs() < 1e-12);
        let d = Distribution::with_invalid(vec![1.0, 2.0, 3.0], 1);
        assert_eq!(d.median, Some(2.5));
        assert_eq!(Distribution::with_invalid(vec![1.0], 1).median, None, "half way to an invalid one");
        assert_eq!(Distribution::with_invalid(vec![], 2).mean, None);
    }

    #[test]
    fn the_bootstrap_resamples_within_strata_and_needs_enough_values() {
        let values = |n: usize, offset: f64| (0..n).map(|i| offset + (i % 5) as f64).collect::<Vec<f64>>();
        assert_eq!(stratified_bootstrap(&[values(9, 0.0)]), None, "nine values");
        assert_eq!(stratified_bootstrap(&[values(10, 0.0), values(4, 0.0)]), None, "a task of four");
        let [low, high] = stratified_bootstrap(&[values(50, 0.0), values(50, 100.0)]).unwrap();
        // The variance within strata is 2; that between them, 2500, does not enter.
        let half = Z95 * (2.0f64 / 100.0).sqrt();
        assert!((low - (52.0 - half)).abs() < 0.05 && (high - (52.0 + half)).abs() < 0.05, "{low} {high}");
        let pooled = stratified_bootstrap(&[[values(50, 0.0), values(50, 100.0)].concat()]).unwrap();
        assert!(pooled[1] - pooled[0] > 10.0, "{pooled:?}");
        assert_eq!(stratified_bootstrap(&[values(50, 0.0)]), stratified_bootstrap(&[values(50, 0.0)]));
        let rate = Rate::new(30, 60).with_bootstrap(&[vec![true; 30], vec![false; 30]]);
        assert_eq!(rate.bootstrap95, Some([50.0, 50.0]), "each task is certain");
    }
}
