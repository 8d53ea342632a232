//! `--require`: what a run must reach, for use in continuous integration.

use crate::{
    cli::error::CliError,
    evaluation::{statistics::Rate, summary::SuiteSummary},
};

/// Takes a number from a suite's results, if it is defined there.
type Measure = fn(&SuiteSummary) -> Option<f64>;

/// Names of what may be required, with what each is.
const MEASURES: [(&str, Measure); 8] = [
    ("goal", |s| share(&s.scores.goal_success_rate)),
    ("no_drop", |s| share(&s.scores.no_drop_rate)),
    ("deformation_ok", |s| share(s.scores.deformation_ok_rate.as_ref()?)),
    ("safety", |s| share(&s.scores.safety_success_rate)),
    ("gap", |s| s.scores.goal_safe_gap.map(|points| points / 100.0)),
    ("d_median", |s| s.scores.deformation.median),
    ("d_p95", |s| s.scores.deformation.p95),
    ("invalid", |s| Some(s.scores.invalid as f64)),
];

fn share(rate: &Rate) -> Option<f64> {
    rate.rate.map(|percent| percent / 100.0)
}

/// One requirement, such as `safety>=0.9`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Requirement {
    text: String,
    measure: usize,
    order: Order,
    bound: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Order {
    AtLeast,
    AtMost,
    Above,
    Below,
}

/// The comparisons, the longer signs first.
const ORDERS: [(&str, Order); 4] =
    [(">=", Order::AtLeast), ("<=", Order::AtMost), (">", Order::Above), ("<", Order::Below)];

/// Reads a requirement.
///
/// # Errors
/// A fragment for people.
pub(crate) fn parse(word: &str) -> Result<Requirement, String> {
    let names = || MEASURES.map(|(name, _)| name).join(", ");
    let cut = ORDERS.iter().find_map(|(sign, order)| Some((word.split_once(sign)?, *order)));
    let ((name, bound), order) =
        cut.ok_or_else(|| format!("expected a comparison such as \"safety>=0.9\", of {}", names()))?;
    let name = name.trim();
    let measure = MEASURES.iter().position(|(known, _)| *known == name);
    let measure = measure.ok_or_else(|| format!("no measure is called {name:?}; there are {}", names()))?;
    let bound = bound.trim();
    let (number, unit) = bound.strip_suffix('%').map_or((bound, 1.0), |number| (number, 0.01));
    let value: Option<f64> = number.trim().parse().ok().filter(|value: &f64| value.is_finite());
    let value = value.ok_or_else(|| format!("expected a number behind the sign, got {bound:?}"))?;
    let is_rate = !matches!(name, "d_median" | "d_p95" | "invalid");
    if is_rate && !(-1.0..=1.0).contains(&(unit * value)) {
        return Err(format!("{name} is a share of 1, got {bound}; write 0.9 or 90%"));
    }
    let bound = unit * value;
    Ok(Requirement { text: word.to_owned(), measure, order, bound })
}

impl Requirement {
    /// What of it a suite's results do not meet: a sentence, or nothing.
    fn missed(&self, summary: &SuiteSummary) -> Option<String> {
        let (name, measure) = MEASURES[self.measure];
        let Some(value) = measure(summary) else {
            return Some(format!("{}: {}: {name} is not defined here", summary.suite, self.text));
        };
        // A rate of 90 % must meet 0.9 whatever its last bit.
        let (slack, bound) = (1e-12, self.bound);
        let met = match self.order {
            Order::AtLeast => value >= bound - slack,
            Order::AtMost => value <= bound + slack,
            Order::Above => value > bound + slack,
            Order::Below => value < bound - slack,
        };
        (!met).then(|| format!("{}: {} is not met: {name} is {value:.4}", summary.suite, self.text))
    }
}

/// Checks all requirements on all suites.
///
/// # Errors
/// Those that are not met, with an exit code of their own.
pub(crate) fn check(requirements: &[Requirement], summaries: &[SuiteSummary]) -> Result<(), CliError> {
    let missed: Vec<String> =
        summaries.iter().flat_map(|s| requirements.iter().filter_map(|r| r.missed(s))).collect();
    if missed.is_empty() { Ok(()) } else { Err(CliError::requirement_not_met(missed.join("\n"))) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::record::tests::sample;

    fn summary(safe: usize, of: usize) -> SuiteSummary {
        let records: Vec<_> = (0..of)
            .map(|i| {
                let mut record = sample();
                record.identity.episode = i as u32;
                record.verdict.safety = i < safe;
                record
            })
            .collect();
        SuiteSummary::of("suite", "expert", &records)
    }

    #[test]
    fn requirements_are_met_up_to_their_bounds() {
        let missed = |word: &str, summary: &SuiteSummary| parse(word).unwrap().missed(summary);
        let nine = summary(9, 10);
        for met in ["safety>=0.9", "safety >= 90 %", "goal>0.99", "gap<=0.1", "invalid<1", "d_p95<0.34"] {
            assert_eq!(missed(met, &nine), None, "{met}");
        }
        assert!(missed("safety>0.9", &nine).is_some_and(|m| m.contains("safety is 0.9000")));
        assert!(missed("invalid>=1", &nine).is_some());
        assert!(missed("goal>=0.5", &summary(0, 0)).is_some_and(|m| m.contains("not defined")));
    }

    #[test]
    fn unknown_measures_and_numbers_are_refused() {
        for (word, words) in [
            ("saftey>=1", "no measure is called \"saftey\""),
            ("safety", "expected a comparison"),
            ("safety>=high", "expected a number"),
            ("safety>=NaN", "got \"NaN\""),
            ("safety>=", "got \"\""),
            ("no_drop>=90", "a share of 1, got 90"),
        ] {
            let error = parse(word).expect_err(words);
            assert!(error.contains(words), "{error}");
        }
    }
}
