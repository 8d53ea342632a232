//! Rates with confidence intervals, means and quantiles.

use serde::{Deserialize, Serialize};

/// Quantile of the normal distribution for a two-sided 95 % interval.
pub(super) const Z95: f64 = 1.959_963_984_540_054;

/// Share of episodes with its uncertainty, in percent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Share, %; null without episodes.
    pub rate: Option<f64>,
    /// 95 % Wilson score interval of the share, %; null without episodes.
    pub wilson95: Option<[f64; 2]>,
}

impl Rate {
    /// Rate of `count` in `total`.
    pub fn new(count: usize, total: usize) -> Self {
        let rate = (total > 0).then(|| 100.0 * count as f64 / total as f64);
        Self { rate, wilson95: wilson95(count, total) }
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
    Some(low + share * (at((rank + 1).min(last)) - low))
}

/// Mean and quantiles of a quantity; all null without values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// Arithmetic mean of the values.
    pub mean: Option<f64>,
    /// 5th percentile of the values.
    pub p5: Option<f64>,
    /// Median (50th percentile).
    pub median: Option<f64>,
    /// 95th percentile of the values.
    pub p95: Option<f64>,
    /// Number of values; 0 of an empty list.
    pub n: usize,
}

impl Distribution {
    /// Distribution of `values`, which must be finite.
    pub fn from_values(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self {
            mean: mean(&values),
            p5: quantile(&values, 0.05),
            median: quantile(&values, 0.5),
            p95: quantile(&values, 0.95),
            n: values.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_agrees_with_values_computed_elsewhere() {
        for (count, total, low, high) in
            [(49, 50, 89.504_556, 99.646_074), (0, 10, 0.0, 27.753_280), (5, 10, 23.659_309, 76.340_691)]
        {
            let [l, h] = wilson95(count, total).unwrap();
            assert!((l - low).abs() < 1e-6 && (h - high).abs() < 1e-6, "{count}/{total}: {l} {h}");
        }
        assert_eq!(wilson95(50, 50).unwrap()[1], 100.0);
        assert_eq!(wilson95(0, 0), None);
    }

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
}
