//! Effects of conditions: runs with one changed factor against the reference of the same suite, policy and seed, on
//! the same episodes. A rigid twin is a condition of its soft original.

use std::collections::BTreeMap;

use super::{
    cells::{interval, signed},
    comparison::ComparedRun,
    run_summary::RunSummary,
};
use softvt_common::table::{Column, Table};
use softvt_evaluation::statistics::{Distribution, Rate};
use softvt_runs::{
    paired_stats::{EpisodePair, PairedComparison, PairedDifference},
    record::EpisodeRecord,
    stored_run::{ConditionLabel, records_as},
};

#[derive(Clone, Debug)]
pub struct ConditionEffects {
    pub suite: String,
    pub method: String,
    /// In the order of factors and values.
    pub effects: Vec<ConditionEffect>,
    pub reference: TrendPoint,
    /// Mean change of Goal Success over all conditions, percentage points; its interval is over episodes.
    pub mean_goal: PairedDifference,
    /// Mean change of Safety Success, as `mean_goal`.
    pub mean_safety: PairedDifference,
}

#[derive(Clone, Debug)]
pub struct ConditionEffect {
    pub change: ConditionLabel,
    pub point: TrendPoint,
    /// The condition minus the reference, on the same episodes.
    pub differences: PairedComparison,
}

/// The records of a run under the name of the soft original.
fn records_of_original(RunSummary { run, .. }: &RunSummary) -> Vec<EpisodeRecord> {
    records_as(&run.records, run.original_suite())
}

/// The effects of all conditions among `runs` whose reference is there too, exactly once.
pub fn condition_effects(runs: &[RunSummary]) -> Vec<ConditionEffects> {
    let mut groups: BTreeMap<_, Vec<&RunSummary>> = BTreeMap::new();
    for run in runs {
        groups.entry(run.run.condition_group()).or_default().push(run);
    }
    groups.values().filter_map(|group| effects_of_group(group)).collect()
}

fn effects_of_group(group: &[&RunSummary]) -> Option<ConditionEffects> {
    let mut references = group.iter().filter(|run| run.run.condition().is_none());
    let (reference, None) = (references.next()?, references.next()) else { return None };
    let reference_records = records_of_original(reference);
    let of_condition = |run: &&RunSummary| Some((run.run.condition()?, records_of_original(run)));
    let mut conditions: Vec<(ConditionLabel, Vec<EpisodeRecord>)> =
        group.iter().filter_map(of_condition).collect();
    conditions.sort_by(|(a, _), (b, _)| a.compare(b));
    let mut effects = Vec::new();
    let mut changed: BTreeMap<_, Vec<&EpisodeRecord>> = BTreeMap::new();
    for (change, records) in &conditions {
        let run = ComparedRun::new(&reference_records, records);
        if run.pairs.is_empty() {
            continue;
        }
        effects.push(ConditionEffect {
            point: TrendPoint {
                value: change.value,
                safety: run.scores().safety_success_rate,
                d_over_tau: run.pairs.iter().filter_map(|pair| pair.second.d_over_tau()).collect(),
            },
            change: change.clone(),
            differences: run.differences,
        });
        for EpisodePair { first, second } in run.pairs {
            changed.entry(first.header.id.index()).or_default().push(second);
        }
    }
    if effects.is_empty() {
        return None;
    }
    let mean = |test: fn(&EpisodeRecord) -> bool| {
        let percent = |record: &EpisodeRecord| {
            if record.outcome.is_valid() && test(record) { 100.0 } else { 0.0 }
        };
        // One value per episode: its mean over the conditions. Episodes are independent, their conditions are not.
        let pairs = reference_records.iter().filter_map(|record| {
            let others = changed.get(&record.header.id.index())?;
            let mean = others.iter().map(|record| percent(record)).sum::<f64>() / others.len() as f64;
            Some([percent(record), mean])
        });
        PairedDifference::from_values(pairs)
    };
    Some(ConditionEffects {
        suite: reference.summary.suite.clone(),
        method: reference.method.clone(),
        reference: TrendPoint {
            value: None,
            safety: reference.summary.scores.safety_success_rate,
            d_over_tau: reference_records.iter().filter_map(EpisodeRecord::d_over_tau).collect(),
        },
        mean_goal: mean(|record| record.verdict.goal),
        mean_safety: match effects.iter().any(|effect| effect.differences.safety.n > 0) {
            true => mean(|record| record.verdict.safety),
            false => PairedDifference::default(),
        },
        effects,
    })
}

fn signed_with_interval(difference: &PairedDifference, digits: usize) -> String {
    let value = signed(difference.difference, digits);
    match (difference.difference, difference.interval95) {
        (Some(_), bounds @ Some(_)) => format!("{value} {}", interval(bounds, digits)),
        _ => value,
    }
}

struct EffectRow<'a> {
    suite: &'a ConditionEffects,
    condition: String,
    episodes: usize,
    goal: PairedDifference,
    safety: PairedDifference,
    d_over_tau: PairedDifference,
}

/// The table of all effects; `None` without any.
pub fn effects_table(effects: &[ConditionEffects]) -> Option<Table> {
    let mut rows = Vec::new();
    for suite in effects {
        rows.extend(suite.effects.iter().map(|effect| {
            let PairedComparison { pairs: episodes, goal, safety, d_over_tau, .. } = effect.differences;
            EffectRow { suite, condition: effect.change.label.clone(), episodes, goal, safety, d_over_tau }
        }));
        if suite.effects.len() > 1 {
            rows.push(EffectRow {
                suite,
                condition: format!("mean of {} conditions", suite.effects.len()),
                episodes: suite.mean_goal.n,
                goal: suite.mean_goal,
                safety: suite.mean_safety,
                d_over_tau: PairedDifference::default(),
            });
        }
    }
    let change = |heading, digits, of: fn(&EffectRow) -> PairedDifference| {
        Column::number(heading, move |row: &EffectRow| signed_with_interval(&of(row), digits))
    };
    let columns = [
        Column::text("Suite", |row: &EffectRow| row.suite.name()),
        Column::text("Condition", |row: &EffectRow| row.condition.clone()),
        Column::number("Episodes", |row: &EffectRow| row.episodes.to_string()),
        change("Δ Goal", 1, |row| row.goal),
        change("Δ Safety", 1, |row| row.safety),
        change("Δ D/τ", 2, |row| row.d_over_tau),
    ];
    (!rows.is_empty()).then(|| {
        Table::new(&rows, columns).with_caption("Change from the reference on the same episodes, percentage points, with 95 % intervals: of single conditions by Agresti and Min, of means by the bootstrap over episodes.")
    })
}

/// Values of a factor with at least two, for its trend.
#[derive(Clone, Debug)]
pub struct FactorTrend {
    pub factor: String,
    /// One point per value, in their order.
    pub points: Vec<TrendPoint>,
}

/// The results at one value of a factor, or of the reference.
#[derive(Clone, Debug)]
pub struct TrendPoint {
    /// Value of the factor; `None` for the reference.
    pub value: Option<f64>,
    pub safety: Rate,
    /// Peak D over τ of each episode.
    pub d_over_tau: Vec<f64>,
}

impl TrendPoint {
    /// Median of D/τ; `None` without an episode.
    pub fn median(&self) -> Option<f64> {
        Distribution::from_values(self.d_over_tau.clone()).median
    }
}

impl ConditionEffects {
    pub fn name(&self) -> String {
        format!("{}, {}", self.suite, self.method)
    }

    /// Factors with at least two values, in order.
    pub fn trends(&self) -> Vec<FactorTrend> {
        let of_factor = |effects: &[ConditionEffect]| {
            let points = effects.iter().map(|effect| &effect.point).filter(|point| point.value.is_some());
            let points: Vec<TrendPoint> = points.cloned().collect();
            (points.len() > 1).then(|| FactorTrend { factor: effects[0].change.factor.clone(), points })
        };
        self.effects.chunk_by(|a, b| a.change.factor == b.change.factor).filter_map(of_factor).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{
        run_summary::{summarize_runs, tests::shift},
        sample_manifest, sample_record,
    };
    use softvt_runs::{manifest::RunManifest, stored_run::StoredRun};

    fn run(dir: &str, shifts: &[(&str, f64)], twin_of: Option<&str>, safe: &[bool]) -> StoredRun {
        let suite = if twin_of.is_some() { "twin" } else { "soft" };
        let records = safe.iter().enumerate().map(|(episode, safe)| {
            let mut record = sample_record();
            (record.header.id.suite, record.header.id.episode) = (suite.to_owned(), episode as u32);
            (record.verdict.goal, record.verdict.safety) = (true, *safe);
            record
        });
        StoredRun {
            dir: Path::new(dir).to_owned(),
            manifest: RunManifest {
                suite: suite.to_owned(),
                twin_of: twin_of.map(str::to_owned),
                shifts: shifts.iter().map(|(name, value)| shift(name, *value)).collect(),
                episodes: safe.len() as u32,
                ..sample_manifest()
            },
            records: records.collect(),
            is_finished: true,
            is_truncated: false,
        }
    }

    #[test]
    fn conditions_are_paired_with_the_reference() {
        let runs = summarize_runs(vec![
            run("a", &[], None, &[true, true, true, false]),
            run("b", &[("mass", 2.5)], None, &[false, false, true, false]),
            run("c", &[("mass", 1.25)], None, &[true, false, true, false]),
            run("d", &[], Some("soft"), &[true, true, true, true]),
        ]);
        let all = condition_effects(&runs);
        let [effects] = &all[..] else { panic!("one suite: {all:?}") };
        let labels: Vec<&str> = effects.effects.iter().map(|effect| effect.change.label.as_str()).collect();
        assert_eq!(labels, ["mass=1.25", "mass=2.5", "rigid twin"]);
        let safety = effects.effects[1].differences.safety;
        assert_eq!((safety.n, safety.difference), (4, Some(-50.0)));
        // The mean over three conditions of (2, 1, 4) of 4 safe episodes, against 3 of 4.
        let mean = effects.mean_safety.difference.expect("episodes");
        assert!((mean - (100.0 * 7.0 / 12.0 - 75.0)).abs() < 1e-9, "{mean}");
        let trends = effects.trends();
        assert_eq!((trends.len(), trends[0].factor.as_str(), trends[0].points.len()), (1, "mass", 2));
        let safety = trends[0].points.iter().map(|point| point.safety).collect::<Vec<_>>();
        assert_eq!(safety, [Rate::new(2, 4), Rate::new(1, 4)]);
        let table = effects_table(&all).expect("effects");
        assert_eq!(table.rows.len(), 4);
        assert!(table.rows[1][4].starts_with("−50.0 ["), "{:?}", table.rows);
        assert_eq!(table.rows[3][1], "mean of 3 conditions");
        assert!(condition_effects(&runs[1..3]).is_empty(), "there is no reference");
    }
}
