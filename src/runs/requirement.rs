//! Conditions on the results of a suite, such as `safety>=0.9`.

use std::str::FromStr;

use super::summary::{GroupScores, SuiteSummary};
use softvt_evaluation::statistics::Rate;

/// Slack of comparisons, so that a rate of 90 % meets 0.9 whatever its last bit.
const TOLERANCE: f64 = 1e-12;

/// A condition on the results of a suite, such as `safety>=0.9`.
#[derive(Clone, Debug)]
pub struct Requirement {
    /// As it was typed.
    text: String,
    metric: &'static Metric,
    comparison: &'static ComparisonSign,
    /// Rates are shares of 1.
    bound: f64,
}

#[derive(Debug)]
struct Metric {
    name: &'static str,
    unit: Unit,
    /// The value, if it is defined for the suite.
    value: fn(&GroupScores) -> Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    Share,
    /// Percent of a length.
    Percent,
    Episodes,
}

static METRICS: [Metric; 8] = [
    Metric { name: "goal", unit: Unit::Share, value: |scores| share(&scores.goal_success_rate) },
    Metric { name: "no_drop", unit: Unit::Share, value: |scores| share(&scores.no_drop_rate) },
    Metric {
        name: "deformation_ok",
        unit: Unit::Share,
        value: |scores| share(scores.deformation_ok_rate.as_ref()?),
    },
    Metric { name: "safety", unit: Unit::Share, value: |scores| share(&scores.safety_success_rate) },
    Metric {
        name: "gap",
        unit: Unit::Share,
        value: |scores| scores.goal_safe_gap.map(|points| points / 100.0),
    },
    Metric { name: "d_median", unit: Unit::Percent, value: |scores| scores.deformation.median },
    Metric { name: "d_p95", unit: Unit::Percent, value: |scores| scores.deformation.p95 },
    Metric { name: "invalid", unit: Unit::Episodes, value: |scores| Some(scores.invalid as f64) },
];

fn share(rate: &Rate) -> Option<f64> {
    rate.rate.map(|percent| percent / 100.0)
}

#[derive(Debug)]
struct ComparisonSign {
    sign: &'static str,
    holds: fn(f64, f64) -> bool,
}

/// The longer signs first, since `>` is a prefix of `>=`.
static COMPARISONS: [ComparisonSign; 4] = [
    ComparisonSign { sign: ">=", holds: |value, bound| value >= bound - TOLERANCE },
    ComparisonSign { sign: "<=", holds: |value, bound| value <= bound + TOLERANCE },
    ComparisonSign { sign: ">", holds: |value, bound| value > bound + TOLERANCE },
    ComparisonSign { sign: "<", holds: |value, bound| value < bound - TOLERANCE },
];

impl FromStr for Requirement {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let names = || METRICS.each_ref().map(|metric| metric.name).join(", ");
        let split = COMPARISONS.iter().find_map(|comparison| {
            word.split_once(comparison.sign).map(|(name, bound)| (name, comparison, bound))
        });
        let (name, comparison, bound) = split.ok_or_else(|| {
            format!("expected a comparison such as \"safety>=0.9\"; metrics are {}", names())
        })?;
        let (name, bound) = (name.trim(), bound.trim());
        let metric = METRICS.iter().find(|metric| metric.name == name);
        let metric = metric.ok_or_else(|| format!("unknown metric {name:?}; metrics are {}", names()))?;
        let (number, factor) = match (bound.strip_suffix('%'), metric.unit) {
            (None, _) => (bound, 1.0),
            (Some(number), Unit::Share) => (number, 0.01),
            (Some(number), Unit::Percent) => (number, 1.0),
            (Some(_), Unit::Episodes) => {
                return Err(format!("{name} is a number of episodes, got {bound}; write {name}<1"));
            }
        };
        let value: Option<f64> = number.trim().parse().ok().filter(|value: &f64| value.is_finite());
        let value = value.ok_or_else(|| format!("expected a number after the sign, got {bound:?}"))?;
        let least = if metric.name == "gap" { -1.0 } else { 0.0 };
        if metric.unit == Unit::Share && !(least..=1.0).contains(&(factor * value)) {
            return Err(format!("{name} is a share of 1, got {bound}; write 0.9 or 90%"));
        }
        Ok(Self { text: word.to_owned(), metric, comparison, bound: factor * value })
    }
}

impl Requirement {
    /// Describes how a suite violates the requirement. `None` if it does not, or if a rigid suite lacks the metric.
    pub fn unmet(&self, summary: &SuiteSummary) -> Option<String> {
        let (suite, text, name) = (&summary.suite, &self.text, self.metric.name);
        let Some(value) = (self.metric.value)(&summary.scores) else {
            let cause = match summary.scores.episodes {
                0 => "there is no episode".to_owned(),
                _ if !summary.scores.is_soft() => return None,
                _ => format!("{name} is not defined for this suite"),
            };
            return Some(format!("{suite}: {text}: {cause}"));
        };
        let is_met = (self.comparison.holds)(value, self.bound);
        (!is_met).then(|| format!("{suite}: {text} is not met: {name} is {value:.4}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::EpisodeRecord;

    fn summary(safe: usize, of: usize) -> SuiteSummary {
        let records: Vec<_> = (0..of)
            .map(|i| {
                let record = include_str!("../../tests/data/episode_record.json");
                let mut record: EpisodeRecord = serde_json::from_str(record).expect("a valid record");
                record.header.id.episode = i as u32;
                record.verdict.safety = i < safe;
                record
            })
            .collect();
        SuiteSummary::from_records("suite", "expert", &records)
    }

    #[test]
    fn requirements_are_met_up_to_their_bounds() {
        let unmet = |word: &str, summary: &SuiteSummary| word.parse::<Requirement>().unwrap().unmet(summary);
        let nine = summary(9, 10);
        for met in [
            "safety>=0.9",
            "safety >= 90 %",
            "goal>0.99",
            "gap<=0.1",
            "invalid<1",
            "d_p95<0.34",
            "d_p95<0.34%",
        ] {
            assert_eq!(unmet(met, &nine), None, "{met}");
        }
        assert!(unmet("safety>0.9", &nine).is_some_and(|m| m.contains("safety is 0.9000")));
        assert!(unmet("invalid>=1", &nine).is_some());
        assert!(unmet("goal>=0.5", &summary(0, 0)).is_some_and(|m| m.contains("there is no episode")));
    }

    #[test]
    fn unknown_metrics_and_numbers_are_refused() {
        for (word, words) in [
            ("saftey>=1", "unknown metric \"saftey\""),
            ("safety", "expected a comparison"),
            ("safety>=high", "expected a number"),
            ("safety>=NaN", "got \"NaN\""),
            ("safety>=", "got \"\""),
            ("no_drop>=90", "a share of 1, got 90"),
            ("invalid<1%", "a number of episodes, got 1%; write invalid<1"),
        ] {
            let error = word.parse::<Requirement>().expect_err(words);
            assert!(error.contains(words), "{error}");
        }
    }
}
