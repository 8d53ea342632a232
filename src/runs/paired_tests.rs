//! Tests of the hypothesis that two runs do not differ, on the episodes that both have.
//!
//! Written here because the statistics crates offer neither an exact test for matched pairs nor one that stays valid
//! when a run is continued.

use std::f64::consts::LN_2;

/// Largest number of pairs whose signed ranks are counted exactly; more use the normal approximation.
const MAX_EXACT_RANKS: usize = 200;

/// Exact two-sided p-value of McNemar's test (Psychometrika 12, 1947): `better` against
/// `worse` under equal probabilities.
pub fn mcnemar(better: usize, worse: usize) -> f64 {
    let n = better + worse;
    let tail: f64 = (0..=better.min(worse)).map(|k| (ln_choose(n, k) - n as f64 * LN_2).exp()).sum();
    (2.0 * tail).min(1.0)
}

/// E-value against equal probabilities of `better` and `worse`: the likelihood of the episodes that differ under a
/// uniform mixture of all probabilities, over that under one half (Robbins, Annals of Mathematical Statistics 41,
/// 1970).
///
/// Under the hypothesis it exceeds `x` at any time of the run with a probability of at most `1/x` (Ville's inequality),
/// so that a run may be continued until it is decided: 20 corresponds to a level of 5 %.
pub fn e_value(better: usize, worse: usize) -> f64 {
    let n = better + worse;
    (n as f64 * LN_2 - ((n + 1) as f64).ln() - ln_choose(n, better)).exp().min(f64::MAX)
}

/// Two-sided p-value of Wilcoxon's signed-rank test (Biometrics 1, 1945) of paired `differences`; zeros are left out,
/// and equal ones share their mean rank. Exact up to 200 differences. `None` if all are zero.
pub fn signed_rank(differences: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0 && d.is_finite()).collect();
    sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    // Twice the ranks, which are whole numbers with ties too.
    let mut ranks = Vec::with_capacity(sorted.len());
    for tied in sorted.chunk_by(|a, b| a.abs() == b.abs()) {
        let twice_mean = 2 * ranks.len() + tied.len() + 1;
        ranks.extend(tied.iter().map(|_| twice_mean));
    }
    let total: usize = ranks.iter().sum();
    let positive: usize = ranks.iter().zip(&sorted).filter(|(_, d)| **d > 0.0).map(|(rank, _)| rank).sum();
    let smaller = positive.min(total - positive);
    match ranks.len() {
        0 => None,
        1..=MAX_EXACT_RANKS => Some((2.0 * exact_tail(&ranks, smaller)).min(1.0)),
        _ => Some(normal_tails(&ranks, smaller)),
    }
}

/// Probability that the ranks with a positive sign sum to at most `smaller`, if every sign is equally likely.
fn exact_tail(ranks: &[usize], smaller: usize) -> f64 {
    let mut probability = vec![0.0; smaller + 1];
    probability[0] = 1.0;
    for &rank in ranks {
        for sum in (0..=smaller).rev() {
            let with_rank = sum.checked_sub(rank).map_or(0.0, |before| probability[before]);
            probability[sum] = 0.5 * (probability[sum] + with_rank);
        }
    }
    probability.iter().sum()
}

/// Both tails beyond `smaller` of the normal distribution with the moments of the sum, with
/// a correction for continuity.
fn normal_tails(ranks: &[usize], smaller: usize) -> f64 {
    let mean = 0.5 * ranks.iter().sum::<usize>() as f64;
    let variance = 0.25 * ranks.iter().map(|rank| (rank * rank) as f64).sum::<f64>();
    let z = (mean - smaller as f64 - 1.0).max(0.0) / variance.sqrt();
    libm::erfc(z / std::f64::consts::SQRT_2)
}

/// Differences of two policies that a number of common episodes can show, in percentage points of a rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectableDifference {
    /// Smallest difference that can be significant at 5 %: that of [`MIN_DISCORDANT`] episodes, which
    /// one policy alone wins.
    pub smallest: f64,
    /// Difference that McNemar's test finds with a probability of 80 % (Connor, Biometrics 43, 1987), for outcomes that
    /// are independent and as frequent as that of the run.
    pub found: f64,
}

/// Least number of episodes that differ for a p-value of McNemar's test below 5 %.
pub const MIN_DISCORDANT: usize = 6;
/// Sum of the quantiles of the normal distribution for a level of 5 % (two-sided) and a power of 80 %.
const QUANTILES: f64 = 1.959_964 + 0.841_621;

impl DetectableDifference {
    /// The differences for a run with `successes` of `episodes`; `None` if it cannot separate any policies.
    pub fn new(successes: usize, episodes: usize) -> Option<Self> {
        if episodes < MIN_DISCORDANT {
            return None;
        }
        // As Agresti and Coull: a run without a failure does not prove a rate of zero.
        let rate = (successes as f64 + 2.0) / (episodes as f64 + 4.0);
        let smallest = 100.0 * MIN_DISCORDANT as f64 / episodes as f64;
        let found = 100.0 * QUANTILES * (2.0 * rate * (1.0 - rate) / episodes as f64).sqrt();
        Some(Self { smallest, found: found.max(smallest).min(100.0) })
    }
}

fn ln_choose(n: usize, k: usize) -> f64 {
    // By logarithms: n may be thousands.
    (1..=k.min(n - k)).map(|i| ((n - k.min(n - k) + i) as f64 / i as f64).ln()).sum()
}

/// Holm's adjustment of p-values for their number (Scandinavian Journal of Statistics 6, 1979), in the same order.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let (mut adjusted, mut largest) = (vec![0.0; p_values.len()], 0.0_f64);
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max((p_values[index] * (p_values.len() - rank) as f64).min(1.0));
        adjusted[index] = largest;
    }
    adjusted
}

/// Letters of a compact letter display (Piepho, Journal of Computational and Graphical Statistics 13, 2004): two of
/// `count` items share a letter if and only if `differ` is false for them. Items should be in the order of their means.
pub fn letters(count: usize, differ: impl Fn(usize, usize) -> bool) -> Vec<String> {
    // Columns of items that share a letter: split where two of them differ, and dropped where another contains them.
    let mut columns: Vec<Vec<usize>> = vec![(0..count).collect()];
    for first in 0..count {
        for second in (first + 1..count).filter(|&second| differ(first, second)) {
            let split = |column: Vec<usize>| {
                if !(column.contains(&first) && column.contains(&second)) {
                    return vec![column];
                }
                [first, second].map(|out| column.iter().copied().filter(|item| *item != out).collect()).into()
            };
            let all: Vec<Vec<usize>> = columns.into_iter().flat_map(split).collect();
            let is_kept = |(at, column): &(usize, &Vec<usize>)| {
                let contains = |other: &Vec<usize>| column.iter().all(|item| other.contains(item));
                !all.iter()
                    .enumerate()
                    .any(|(i, other)| i != *at && contains(other) && (other.len() > column.len() || i < *at))
            };
            columns = all.iter().enumerate().filter(is_kept).map(|(_, column)| column.clone()).collect();
        }
    }
    columns.sort();
    let name = |index: usize| {
        let letter = char::from(b'a' + (index % 26) as u8);
        letter.to_string().repeat(index / 26 + 1)
    };
    let of = |item: usize| {
        let own = columns.iter().enumerate().filter(|(_, column)| column.contains(&item));
        own.map(|(index, _)| name(index)).collect()
    };
    (0..count).map(of).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn mcnemars_test_is_the_binomial_one() {
        assert_eq!((mcnemar(0, 0), mcnemar(5, 5)), (1.0, 1.0));
        assert!((mcnemar(0, 6) - 2.0 / 64.0).abs() < 1e-15);
        assert!((mcnemar(12, 4) - 0.076_812_744).abs() < 1e-9);
        assert!((mcnemar(2100, 1900) - 0.001_649_266_375).abs() < 1e-11);
    }

    #[test]
    fn the_mean_of_the_e_value_is_one_if_the_runs_do_not_differ() {
        for n in [1, 2, 7, 40] {
            let terms = (0..=n).map(|k| (ln_choose(n, k) - n as f64 * LN_2).exp() * e_value(k, n - k));
            assert!((terms.sum::<f64>() - 1.0).abs() < 1e-9, "{n}");
        }
        assert_eq!(e_value(0, 0), 1.0);
        assert!((e_value(8, 0) - 256.0 / 9.0).abs() < 1e-9);
        assert!(e_value(5000, 0).is_finite());
    }

    /// Values of R's `wilcox.test(x, exact = TRUE)`.
    #[test]
    fn signed_ranks_have_the_published_p_values() {
        let darwin =
            [6.125, -8.375, 1.0, 2.0, 0.75, 2.875, 3.5, 5.125, 1.75, 3.625, 7.0, 3.0, 9.375, 7.5, -6.0];
        assert!((signed_rank(&darwin).unwrap() - 0.041_259_765_625).abs() < 1e-12);
        assert_eq!(signed_rank(&[0.0, 0.0]), None);
        assert_eq!(signed_rank(&[1.0, -1.0]), Some(1.0), "equal ranks");
        let sure: Vec<f64> = (1..=6).map(f64::from).collect();
        assert_eq!(signed_rank(&sure), Some(2.0 / 64.0));
    }

    #[test]
    fn many_ranks_have_nearly_the_exact_p_value() {
        let differences: Vec<f64> =
            (1..=200).map(|i| if i % 5 < 3 { -f64::from(i) } else { f64::from(i) }).collect();
        let exact = signed_rank(&differences).unwrap();
        let ranks: Vec<usize> = (1..=200).map(|rank| 2 * rank).collect();
        let positive: usize = ranks.iter().zip(&differences).filter(|(_, d)| **d > 0.0).map(|(r, _)| r).sum();
        let approximate = normal_tails(&ranks, positive.min(ranks.iter().sum::<usize>() - positive));
        assert!((exact - approximate).abs() < 1e-3, "{exact} {approximate}");
    }

    #[test]
    fn fifty_episodes_separate_policies_that_differ_by_12_points_at_least() {
        let resolution = DetectableDifference::new(25, 50).unwrap();
        assert_eq!(resolution.smallest, 12.0);
        assert!((resolution.found - 28.0).abs() < 0.1, "{}", resolution.found);
        assert!(mcnemar(MIN_DISCORDANT, 0) < 0.05 && mcnemar(MIN_DISCORDANT - 1, 0) > 0.05);
        assert_eq!(DetectableDifference::new(5, 5), None);
        assert_eq!(DetectableDifference::new(6, 6).unwrap().found, 100.0);
    }

    #[test]
    fn holm_multiplies_the_smallest_most() {
        assert_eq!(holm(&[0.01, 0.04, 0.03]), [0.03, 0.06, 0.06]);
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    }

    #[test]
    fn items_that_do_not_differ_share_a_letter() {
        let chain = letters(3, |i, j| j - i > 1);
        assert_eq!(chain, ["a", "ab", "b"]);
        assert_eq!(letters(3, |_, _| false), ["a"; 3]);
        assert_eq!(letters(3, |_, _| true), ["a", "b", "c"]);
    }

    proptest! {
        #[test]
        fn letters_are_shared_exactly_by_items_that_do_not_differ(
            count in 1_usize..7,
            pairs in prop::collection::vec(any::<bool>(), 49),
        ) {
            let differ = |i: usize, j: usize| pairs[7 * i.min(j) + i.max(j)];
            let found = letters(count, differ);
            for i in 0..count {
                prop_assert!(!found[i].is_empty());
                for j in i + 1..count {
                    let shares = found[i].chars().any(|letter| found[j].contains(letter));
                    prop_assert_eq!(shares, !differ(i, j), "{:?}", found);
                }
            }
        }
    }
}
