//! Comparison of three or more runs on the episodes that all of them have.

use std::{cmp::Reverse, collections::BTreeSet};

use serde::Serialize;

use super::comparison::{CompareError, check_unique, differing_fields, names, no_common_episode, records};
use softvt_common::text::{TextColumn, TextTable, counted, decimal, shortened};
use softvt_evaluation::{category::EpisodeCategory, statistics::Rate};
use softvt_runs::{
    paired_stats::{EpisodePair, PairedComparison, pair_episodes},
    paired_tests::{holm, letters},
    record::EpisodeRecord,
    stored_run::StoredRun,
    summary::{GroupScores, method_label},
};

/// Level at which two runs count as different, after Holm's adjustment for the number of pairs.
const LEVEL: f64 = 0.05;

/// One of several runs of the same episodes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RankedRun {
    /// Policy, or the folder if the policies have one name, with its privileged inputs.
    pub name: String,
    /// Goal Success over the common episodes.
    pub goal: Rate,
    /// Safety Success over the common episodes.
    pub safety: Rate,
    /// Median of peak D over τ.
    pub d_over_tau: Option<f64>,
    /// Runs that share a letter do not differ in Safety Success (McNemar's test).
    pub safety_letters: String,
    /// Runs that share a letter do not differ in D/τ (Wilcoxon's signed-rank test).
    pub d_over_tau_letters: String,
}

/// Several runs by decreasing Safety Success.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolicyRanking {
    /// Number of episodes that all runs have.
    pub episodes: usize,
    /// Level of the tests, adjusted for their number by Holm's method.
    pub level: f64,
    /// The runs.
    pub runs: Vec<RankedRun>,
    /// Fields of `run.json`, other than the policy, in which a run differs from the first one.
    pub differing_fields: Vec<String>,
}

impl PolicyRanking {
    /// Compares the runs of several folders, each with one run per suite.
    ///
    /// # Errors
    /// An episode occurs twice in a folder, or there is no episode that all folders have.
    pub fn new(folders: &[Vec<StoredRun>]) -> Result<Self, CompareError> {
        folders.iter().try_for_each(|runs| check_unique(runs))?;
        let Some((first, rest)) = folders.split_first() else {
            return Ok(Self { episodes: 0, level: LEVEL, runs: Vec::new(), differing_fields: Vec::new() });
        };
        let mut common: Vec<&EpisodeRecord> = records(first).collect();
        for other in rest {
            let pairs = pair_episodes(common, records(other));
            common = pairs.iter().map(|pair| pair.first).collect();
            if common.is_empty() {
                return Err(no_common_episode(first, other));
            }
        }
        let differing: BTreeSet<String> =
            rest.iter().flat_map(|other| differing_fields(first, other)).collect();
        let in_common = |runs: &'_ [StoredRun]| {
            let pairs = pair_episodes(common.iter().copied(), records(runs));
            pairs.into_iter().map(|pair| pair.second.clone()).collect()
        };
        let marked = |(name, runs): (String, &Vec<StoredRun>)| {
            let marks = runs.first().map(StoredRun::marks).unwrap_or_default();
            (method_label(&name, marks), in_common(runs))
        };
        let mut runs: Vec<(String, Vec<EpisodeRecord>)> =
            names(folders).into_iter().zip(folders).map(marked).collect();
        let scores =
            |records: &[EpisodeRecord]| GroupScores::from_records(&records.iter().collect::<Vec<_>>());
        runs.sort_by_key(|(_, records)| Reverse(scores(records).count(EpisodeCategory::Safe)));
        let compared = |a: usize, b: usize| {
            let pairs = runs[a].1.iter().zip(&runs[b].1).map(|(first, second)| EpisodePair { first, second });
            PairedComparison::from_pairs(&pairs.collect::<Vec<_>>())
        };
        let safety_letters = letters_of(runs.len(), |a, b| compared(a, b).safety.p);
        let d_letters = letters_of(runs.len(), |a, b| compared(a, b).d_over_tau.p);
        let ranked = runs.iter().zip(safety_letters.into_iter().zip(d_letters));
        let runs = ranked.map(|((name, records), (safety_letters, d_over_tau_letters))| {
            let GroupScores { goal_success_rate: goal, safety_success_rate: safety, d_over_tau, .. } =
                scores(records);
            let (name, d_over_tau) = (name.clone(), d_over_tau.median);
            RankedRun { name, goal, safety, d_over_tau, safety_letters, d_over_tau_letters }
        });
        Ok(Self {
            episodes: common.len(),
            level: LEVEL,
            runs: runs.collect(),
            differing_fields: differing.into_iter().collect(),
        })
    }

    /// The ranking as a plain-text table.
    pub fn table(&self) -> String {
        const COLUMNS: [TextColumn; 6] = {
            use TextColumn::{Left, Right};
            [Left(28), Right(15), Right(15), Left(4), Right(7), Left(4)]
        };
        let mut table = TextTable::new(COLUMNS);
        table.line(format!("{} that all runs have", counted(self.episodes, "episode")));
        table.row(["policy", "Goal, %", "Safety, %", "", "D/limit", ""]);
        table.rule();
        for run in &self.runs {
            table.row([
                shortened(&run.name, 28),
                interval(&run.goal),
                interval(&run.safety),
                run.safety_letters.clone(),
                decimal(run.d_over_tau, 2),
                run.d_over_tau_letters.clone(),
            ]);
        }
        table.rule();
        table.line("95 % Wilson intervals · D/limit: median of peak D over τ");
        table.line("policies that share a letter do not differ at 5 % (paired tests: McNemar's of");
        table.line("Safety, Wilcoxon's signed-rank of D/limit; adjusted by Holm's method)");
        if !self.differing_fields.is_empty() {
            table.line(format!("the runs also differ in {} (run.json)", self.differing_fields.join(", ")));
        }
        table.text
    }
}

/// Letters of runs whose pairs have these p-values; without one, two runs do not differ.
fn letters_of(count: usize, p_value: impl Fn(usize, usize) -> Option<f64>) -> Vec<String> {
    let pairs: Vec<[usize; 2]> = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b])).collect();
    let p_values: Vec<f64> = pairs.iter().map(|&[a, b]| p_value(a, b).unwrap_or(1.0)).collect();
    let adjusted = holm(&p_values);
    letters(count, |a, b| {
        pairs.iter().position(|pair| *pair == [a.min(b), a.max(b)]).is_some_and(|at| adjusted[at] < LEVEL)
    })
}

fn interval(rate: &Rate) -> String {
    match rate.wilson95 {
        Some([low, high]) => format!("{} [{low:.0}, {high:.0}]", decimal(rate.rate, 0)),
        None => decimal(rate.rate, 0),
    }
}
