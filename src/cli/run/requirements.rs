//! Evaluation of `--require` on the results of suites.

use crate::{
    cli::{
        args::{RequiredMetric, Requirement, RequirementOperator},
        error::CliError,
    },
    evaluation::{statistics::Rate, summary::SuiteSummary},
};

/// Slack of comparisons, so that a rate of 90 % meets 0.9 whatever its last bit.
const TOLERANCE: f64 = 1e-12;

/// Checks all requirements on all suites.
///
/// # Errors
/// The requirements that are not met.
pub(crate) fn check(requirements: &[Requirement], summaries: &[SuiteSummary]) -> Result<(), CliError> {
    let unmet = summaries
        .iter()
        .flat_map(|summary| requirements.iter().filter_map(move |requirement| unmet(requirement, summary)));
    let unmet: Vec<String> = unmet.collect();
    if unmet.is_empty() { Ok(()) } else { Err(CliError::requirement_not_met(unmet.join("\n"))) }
}

/// Describes a requirement that a suite does not meet.
fn unmet(requirement: &Requirement, summary: &SuiteSummary) -> Option<String> {
    let Requirement { text, metric, operator, bound } = requirement;
    let (suite, name) = (&summary.suite, metric.name());
    let Some(value) = value_of(*metric, summary) else {
        return Some(format!("{suite}: {text}: {name} is not defined for this suite"));
    };
    let is_met = match operator {
        RequirementOperator::AtLeast => value >= bound - TOLERANCE,
        RequirementOperator::AtMost => value <= bound + TOLERANCE,
        RequirementOperator::Above => value > bound + TOLERANCE,
        RequirementOperator::Below => value < bound - TOLERANCE,
    };
    (!is_met).then(|| format!("{suite}: {text} is not met: {name} is {value:.4}"))
}

/// The value of a metric, if it is defined for the suite. Rates are shares of 1.
fn value_of(metric: RequiredMetric, summary: &SuiteSummary) -> Option<f64> {
    let share = |rate: &Rate| rate.rate.map(|percent| percent / 100.0);
    let scores = &summary.scores;
    match metric {
        RequiredMetric::Goal => share(&scores.goal_success_rate),
        RequiredMetric::NoDrop => share(&scores.no_drop_rate),
        RequiredMetric::DeformationOk => share(scores.deformation_ok_rate.as_ref()?),
        RequiredMetric::Safety => share(&scores.safety_success_rate),
        RequiredMetric::GoalSafetyGap => scores.goal_safe_gap.map(|points| points / 100.0),
        RequiredMetric::MedianDeformation => scores.deformation.median,
        RequiredMetric::P95Deformation => scores.deformation.p95,
        RequiredMetric::InvalidEpisodes => Some(scores.invalid as f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::record::tests::sample;

    fn summary(safe: usize, of: usize) -> SuiteSummary {
        let records: Vec<_> = (0..of)
            .map(|i| {
                let mut record = sample();
                record.header.id.episode = i as u32;
                record.verdict.safety = i < safe;
                record
            })
            .collect();
        SuiteSummary::of("suite", "expert", &records)
    }

    #[test]
    fn requirements_are_met_up_to_their_bounds() {
        let unmet = |word: &str, summary: &SuiteSummary| unmet(&word.parse().unwrap(), summary);
        let nine = summary(9, 10);
        for met in ["safety>=0.9", "safety >= 90 %", "goal>0.99", "gap<=0.1", "invalid<1", "d_p95<0.34"] {
            assert_eq!(unmet(met, &nine), None, "{met}");
        }
        assert!(unmet("safety>0.9", &nine).is_some_and(|m| m.contains("safety is 0.9000")));
        assert!(unmet("invalid>=1", &nine).is_some());
        assert!(unmet("goal>=0.5", &summary(0, 0)).is_some_and(|m| m.contains("not defined")));
    }
}
