//! Two policies on the same episodes: differences with their uncertainty, episode by episode.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use serde::{Deserialize, Serialize};

use super::statistics::{Z95, mean, percentile};

/// Resamples of the bootstrap.
const RESAMPLES: usize = 4000;

/// The difference of two shares of the same episodes, in percentage points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateDifference {
    /// Episodes that both ran.
    pub n: usize,
    /// The first's share, %; null without episodes.
    pub first: Option<f64>,
    /// The second's, %.
    pub second: Option<f64>,
    /// Episodes of which only the second has it.
    pub better: usize,
    /// Those of which only the first has it.
    pub worse: usize,
    /// All others.
    pub same: usize,
    /// Second minus first, points; null without episodes.
    pub difference: Option<f64>,
    /// Its 95 % interval, points.
    pub interval95: Option<[f64; 2]>,
    /// Exact two-sided p-value of McNemar's test (binomial on the episodes that differ).
    pub p: f64,
}

impl RateDifference {
    /// From whether each episode has it, first and second.
    pub fn of(pairs: impl IntoIterator<Item = (bool, bool)>) -> Self {
        let (mut n, mut had, mut better, mut worse) = (0, 0, 0, 0);
        for (first, second) in pairs {
            n += 1;
            had += usize::from(first);
            better += usize::from(second && !first);
            worse += usize::from(first && !second);
        }
        let points = |share: f64| (100.0 * share).clamp(-100.0, 100.0);
        let percent = |count: usize| (n > 0).then(|| points(count as f64 / n as f64));
        Self {
            n,
            first: percent(had),
            second: percent(had + better - worse),
            better,
            worse,
            same: n - better - worse,
            difference: (n > 0).then(|| points((better as f64 - worse as f64) / n as f64)),
            interval95: (n > 0).then(|| agresti_min(n, better, worse).map(points)),
            p: mcnemar(better, worse),
        }
    }
}

/// 95 % interval of a difference of matched shares (Agresti & Min, Statistics in Medicine 24, 2005): Wald's with half an
/// episode more in each cell of the 2 × 2 table.
fn agresti_min(n: usize, better: usize, worse: usize) -> [f64; 2] {
    let (n, b, c) = (n as f64 + 2.0, better as f64 + 0.5, worse as f64 + 0.5);
    let centre = (b - c) / n;
    let half = Z95 * ((b + c) - (b - c) * (b - c) / n).sqrt() / n;
    [centre - half, centre + half]
}

/// Exact two-sided p-value of `better` against `worse` under equal chances.
fn mcnemar(better: usize, worse: usize) -> f64 {
    let n = better + worse;
    let fewer = better.min(worse);
    // Binomial terms by their logarithms: n may be thousands.
    let ln_choose = |k: usize| (1..=k).map(|i| ((n - k + i) as f64 / i as f64).ln()).sum::<f64>();
    let tail: f64 = (0..=fewer).map(|k| (ln_choose(k) - n as f64 * std::f64::consts::LN_2).exp()).sum();
    (2.0 * tail).min(1.0)
}

/// The mean difference of a quantity over the same episodes, of which less is better.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanDifference {
    /// Episodes in which both have it.
    pub n: usize,
    /// The first's mean; null without episodes.
    pub first: Option<f64>,
    /// The second's.
    pub second: Option<f64>,
    /// Episodes in which the second has less.
    pub better: usize,
    /// Those in which it has more.
    pub worse: usize,
    /// Those in which both have the same.
    pub same: usize,
    /// Second minus first.
    pub difference: Option<f64>,
    /// Its 95 % interval: percentile bootstrap over episodes (Efron, 1979), from a fixed seed.
    pub interval95: Option<[f64; 2]>,
}

impl MeanDifference {
    /// From the quantity in each episode, first and second.
    pub fn of(pairs: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (first, second): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
        let differences: Vec<f64> = first.iter().zip(&second).map(|(first, second)| second - first).collect();
        let count = |test: fn(&f64) -> bool| differences.iter().filter(|d| test(d)).count();
        let (better, worse) = (count(|d| *d < 0.0), count(|d| *d > 0.0));
        Self {
            n: differences.len(),
            first: mean(&first),
            second: mean(&second),
            better,
            worse,
            same: differences.len() - better - worse,
            difference: mean(&differences),
            interval95: bootstrap(&differences),
        }
    }
}

/// 95 % interval of a mean: percentile bootstrap; `None` of fewer than two values.
fn bootstrap(values: &[f64]) -> Option<[f64; 2]> {
    let n = values.len();
    if n < 2 {
        return None;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(n as u64);
    let mut means: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let draw = |_| values[((rng.next_u64() >> 32) as usize * n) >> 32];
            (0..n).map(draw).sum::<f64>() / n as f64
        })
        .collect();
    means.sort_by(f64::total_cmp);
    percentile(&means, 2.5).zip(percentile(&means, 97.5)).map(|(low, high)| [low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_agrees_with_one_computed_by_hand() {
        // 100 pairs, 12 gained, 4 lost: centre 8/102, half 1.96 √(17 − 64/102)/102.
        let pairs = (0..100).map(|i| (i < 4, (4..16).contains(&i)));
        let of = RateDifference::of(pairs);
        assert_eq!((of.n, of.better, of.worse, of.same), (100, 12, 4, 84));
        assert_eq!((of.first, of.second), (Some(4.0), Some(12.0)));
        assert!((of.difference.unwrap() - 8.0).abs() < 1e-12);
        let [low, high] = of.interval95.unwrap();
        assert!((low - 0.067_3).abs() < 2e-3 && (high - 15.619).abs() < 2e-3, "{low} {high}");
        // 2 (1 + 16 + 120 + 560 + 1820) / 2¹⁶.
        assert!((of.p - 2.0 * 2517.0 / 65536.0).abs() < 1e-12, "{}", of.p);
    }

    #[test]
    fn equal_runs_differ_in_nothing() {
        let of = RateDifference::of((0..50).map(|i| (i % 2 == 0, i % 2 == 0)));
        assert_eq!((of.difference, of.p), (Some(0.0), 1.0));
        assert!(of.interval95.unwrap()[0] < 0.0, "50 episodes do not prove equality");
        let none = RateDifference::of([]);
        assert_eq!((none.difference, none.interval95, none.p), (None, None, 1.0));
    }

    #[test]
    fn a_bootstrap_is_near_the_normal_interval_and_the_same_every_time() {
        let pairs: Vec<(f64, f64)> = (0..400).map(|i| (0.0, 1.0 + f64::from(i % 20) / 20.0)).collect();
        let of = MeanDifference::of(pairs.clone());
        let [low, high] = of.interval95.unwrap();
        // Standard deviation 0.2884, so ± 1.96 × 0.2884 / 20.
        assert!((high - low - 0.0565).abs() < 0.005, "{low} {high}");
        assert_eq!(of, MeanDifference::of(pairs));
        assert_eq!((of.n, of.better, of.worse, of.same, of.first), (400, 0, 400, 0, Some(0.0)));
        assert_eq!(MeanDifference::of([(1.0, 3.0)]).interval95, None);
    }
}
