//! Comparison of three or more runs on the episodes that all of them have.

use std::{cmp::Reverse, collections::BTreeSet};

use serde::Serialize;

use super::{
    comparison::{CompareError, ComparedRun, differing_fields, names, no_common_episode, records, unusable},
    styled_text::TerminalFormat,
};
use softvt_common::{
    table::{Column, Table},
    text::{counted, decimal},
};
use softvt_evaluation::{category::EpisodeCategory, statistics::Rate};
use softvt_runs::{
    paired_stats::{PairedComparison, PairedDifference, pair_episodes},
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
    pub goal: Rate,
    /// Not judged without a soft target.
    pub safety: Rate,
    /// Median of peak D over τ.
    pub d_over_tau: Option<f64>,
    /// Runs that share a letter do not differ in Safety Success (McNemar's test); empty for a run without it.
    pub safety_letters: String,
    /// Runs that share a letter do not differ in D/τ (Wilcoxon's signed-rank test); empty for a run without it.
    pub d_over_tau_letters: String,
}

/// Several runs by decreasing Safety Success.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolicyRanking {
    /// Number of episodes that all runs have.
    pub episodes: usize,
    /// Level of the tests, adjusted for their number by Holm's method.
    pub level: f64,
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
        if let Some(error) = folders.iter().find_map(|runs| unusable(runs)) {
            return Err(error);
        }
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
        let mut ranked: Vec<(String, GroupScores, Vec<&EpisodeRecord>)> = Vec::new();
        for (name, runs) in names(folders).into_iter().zip(folders) {
            let name = method_label(&name, runs.first().map(StoredRun::marks).unwrap_or_default());
            let pairs = pair_episodes(common.iter().copied(), records(runs));
            let records: Vec<&EpisodeRecord> = pairs.into_iter().map(|pair| pair.second).collect();
            ranked.push((name, GroupScores::from_records(&records), records));
        }
        ranked.sort_by_key(|(_, scores, _)| Reverse(scores.count(EpisodeCategory::Safe)));
        let count = ranked.len();
        let pairs: Vec<[usize; 2]> = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b])).collect();
        let compare = |&[a, b]: &[usize; 2]| {
            ComparedRun::new(ranked[a].2.iter().copied(), ranked[b].2.iter().copied()).differences
        };
        let compared: Vec<PairedComparison> = pairs.iter().map(compare).collect();
        let letters_of = |of: fn(&PairedComparison) -> &PairedDifference| {
            // Without a p-value, two runs do not differ.
            let p_values: Vec<f64> = compared.iter().map(|pair| of(pair).p.unwrap_or(1.0)).collect();
            let adjusted = holm(&p_values);
            let at = |a: usize, b: usize| pairs.iter().position(|pair| *pair == [a.min(b), a.max(b)]);
            let letters = letters(count, |a, b| at(a, b).is_some_and(|at| adjusted[at] < LEVEL));
            let is_compared =
                |run| pairs.iter().zip(&compared).any(|(pair, by)| pair.contains(&run) && of(by).n > 0);
            let of_run = |(run, own)| if is_compared(run) { own } else { String::new() };
            letters.into_iter().enumerate().map(of_run).collect::<Vec<_>>()
        };
        let letters = letters_of(|of| &of.safety).into_iter().zip(letters_of(|of| &of.d_over_tau));
        let runs =
            ranked.iter().zip(letters).map(|((name, scores, _), (safety_letters, d_over_tau_letters))| {
                RankedRun {
                    name: name.clone(),
                    goal: scores.goal_success_rate,
                    safety: scores.safety_success_rate,
                    d_over_tau: scores.d_over_tau.median,
                    safety_letters,
                    d_over_tau_letters,
                }
            });
        Ok(Self {
            episodes: common.len(),
            level: LEVEL,
            runs: runs.collect(),
            differing_fields: differing.into_iter().collect(),
        })
    }

    pub fn table(&self) -> String {
        let columns = [
            Column::text("policy", |run: &RankedRun| run.name.clone()).width(28),
            Column::number("Goal, %", |run: &RankedRun| interval(&run.goal)).width(15),
            Column::number("Safety, %", |run: &RankedRun| interval(&run.safety)).width(15),
            Column::text("", |run: &RankedRun| run.safety_letters.clone()).width(4),
            Column::number("D/limit", |run: &RankedRun| decimal(run.d_over_tau, 2)).width(7),
            Column::text("", |run: &RankedRun| run.d_over_tau_letters.clone()).width(4),
        ];
        let mut lines = Table::new(&self.runs, columns).lines();
        let rule = "─".repeat(TerminalFormat::DEFAULT_WIDTH - 1);
        lines.insert(0, format!("{} that all runs have", counted(self.episodes, "episode")));
        lines.insert(2, rule.clone());
        lines.extend([
            rule,
            "95 % Wilson intervals · D/limit: median of peak D over τ".to_owned(),
            "policies that share a letter do not differ at 5 % (paired tests: McNemar's of".to_owned(),
            "Safety, Wilcoxon's signed-rank of D/limit; adjusted by Holm's method)".to_owned(),
        ]);
        if !self.differing_fields.is_empty() {
            lines.push(format!("the runs also differ in {} (run.json)", self.differing_fields.join(", ")));
        }
        lines.join("\n") + "\n"
    }
}

fn interval(rate: &Rate) -> String {
    match rate.wilson95 {
        Some([low, high]) => format!("{} [{low:.0}, {high:.0}]", decimal(rate.rate, 0)),
        None => "N/A".to_owned(),
    }
}
