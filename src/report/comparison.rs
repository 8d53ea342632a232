//! What two runs differ in: the same episodes, one by one.

use std::{collections::BTreeMap, fmt::Write};

use serde::Serialize;

use super::runs::StoredRun;
use crate::evaluation::{
    difference::{MeanDifference, RateDifference},
    record::EpisodeRecord,
};

/// What makes an episode of two runs the same.
type Key<'a> = (&'a str, usize, u32, u64, &'a str, &'a str);

fn key(record: &EpisodeRecord) -> Key<'_> {
    let id = &record.identity;
    (&id.suite, id.task, id.episode, id.seed, &id.split, &id.layout)
}

/// Differences over a group of episodes: the second run minus the first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Differences {
    /// Goal Success, points.
    pub goal: RateDifference,
    /// NoDrop, points.
    pub no_drop: RateDifference,
    /// Safety Success, points.
    pub safety: RateDifference,
    /// Peak D where both have one, % of the diagonal.
    pub d_peak: MeanDifference,
}

/// One task of a suite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskDifferences {
    /// Suite.
    pub suite: String,
    /// Task index.
    pub task: usize,
    /// Instruction.
    pub prompt: String,
    /// Its differences.
    #[serde(flatten)]
    pub differences: Differences,
}

/// Two runs compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// What the first is called.
    pub first: String,
    /// What the second is called.
    pub second: String,
    /// Episodes that only one of them has.
    pub unmatched: usize,
    /// What the runs were not alike in besides their policies: paths of `run.json`.
    pub unlike: Vec<String>,
    /// All episodes that both have.
    pub all: Differences,
    /// By task, in order.
    pub by_task: Vec<TaskDifferences>,
}

impl Differences {
    fn of(pairs: &[(&EpisodeRecord, &EpisodeRecord)]) -> Self {
        let rate = |test: fn(&EpisodeRecord) -> bool| {
            let holds = |r: &EpisodeRecord| r.outcome.is_valid() && test(r);
            RateDifference::of(pairs.iter().map(|(a, b)| (holds(a), holds(b))))
        };
        Self {
            goal: rate(|r| r.verdict.goal),
            no_drop: rate(|r| r.verdict.no_drop),
            safety: rate(|r| r.verdict.safety),
            d_peak: MeanDifference::of(pairs.iter().filter_map(|(a, b)| {
                let peak = |r: &EpisodeRecord| r.verdict.d_peak.filter(|_| r.outcome.is_valid());
                peak(a).zip(peak(b))
            })),
        }
    }
}

/// Compares the episodes that both have; `None` if there is none.
pub fn compare(first: &[StoredRun], second: &[StoredRun]) -> Option<Comparison> {
    let index = |runs: &'_ [StoredRun]| -> usize { runs.iter().map(|run| run.records.len()).sum() };
    let of_second: BTreeMap<Key, &EpisodeRecord> =
        second.iter().flat_map(|run| &run.records).map(|record| (key(record), record)).collect();
    let of_first: BTreeMap<Key, &EpisodeRecord> =
        first.iter().flat_map(|run| &run.records).map(|record| (key(record), record)).collect();
    let pairs: Vec<(&EpisodeRecord, &EpisodeRecord)> =
        of_first.iter().filter_map(|(key, a)| Some((*a, *of_second.get(key)?))).collect();
    if pairs.is_empty() {
        return None;
    }
    let mut tasks: BTreeMap<(&str, usize), Vec<(&EpisodeRecord, &EpisodeRecord)>> = BTreeMap::new();
    for pair in &pairs {
        tasks.entry((&pair.0.identity.suite, pair.0.identity.task)).or_default().push(*pair);
    }
    let by_task = tasks.into_iter().map(|((suite, task), pairs)| TaskDifferences {
        suite: suite.to_owned(),
        task,
        prompt: pairs[0].0.identity.prompt.clone(),
        differences: Differences::of(&pairs),
    });
    Some(Comparison {
        first: name(first),
        second: name(second),
        unmatched: index(first) + index(second) - 2 * pairs.len(),
        unlike: unlike(first, second),
        all: Differences::of(&pairs),
        by_task: by_task.collect(),
    })
}

fn name(runs: &[StoredRun]) -> String {
    let mut names: Vec<&str> = runs.iter().map(|run| run.text("policy")).collect();
    names.dedup();
    names.join(", ")
}

/// Fields of `run.json` that say how a policy was judged, where two runs of one suite differ.
fn unlike(first: &[StoredRun], second: &[StoredRun]) -> Vec<String> {
    const JUDGED_BY: [&str; 7] = ["softvt", "twin", "shifts", "options", "settings", "sources", "thresholds"];
    let mut found: Vec<String> = Vec::new();
    for a in first {
        let Some(b) = second.iter().find(|b| b.text("suite") == a.text("suite")) else { continue };
        found.extend(
            JUDGED_BY.iter().filter(|field| a.info[**field] != b.info[**field]).map(|f| (*f).to_owned()),
        );
    }
    found.sort();
    found.dedup();
    found
}

/// The comparison as a table.
pub fn table(comparison: &Comparison) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: String| {
        let _ = writeln!(out, "{}", text.trim_end());
    };
    line(format!("{} → {}: {} paired episodes", comparison.first, comparison.second, comparison.all.goal.n));
    line(format!(
        "{:<34} {:>20} {:>20} {:>22}",
        "", "Goal, points", "Safety, points", "D peak, % of diagonal"
    ));
    let mut suite = "";
    for task in &comparison.by_task {
        if task.suite != suite {
            suite = &task.suite;
            line(suite.to_owned());
        }
        let prompt: String = task.prompt.chars().take(28).collect();
        line(row(&format!("{:>3} {prompt}", task.task), &task.differences));
    }
    line(row("all", &comparison.all));
    line(format!(
        "{:<34} {:>20} {:>20}",
        "episodes gained, lost",
        counts(&comparison.all.goal),
        counts(&comparison.all.safety)
    ));
    line(format!(
        "{:<34} {:>20.4} {:>20.4}",
        "p (McNemar, exact)", comparison.all.goal.p, comparison.all.safety.p
    ));
    if comparison.unmatched > 0 {
        line(format!("{} episodes that only one run has are left out", comparison.unmatched));
    }
    if !comparison.unlike.is_empty() {
        line(format!("the runs also differ in {} (run.json)", comparison.unlike.join(", ")));
    }
    line("second minus first; 95 % intervals: Agresti and Min for rates, bootstrap for D".to_owned());
    out
}

fn row(name: &str, d: &Differences) -> String {
    let rate = |of: &RateDifference| spread(of.difference, of.interval95, 1);
    let d_peak = spread(d.d_peak.difference, d.d_peak.interval95, 2);
    format!("{name:<34} {:>20} {:>20} {d_peak:>22}", rate(&d.goal), rate(&d.safety))
}

fn spread(value: Option<f64>, interval: Option<[f64; 2]>, digits: usize) -> String {
    let Some(value) = value else { return "–".to_owned() };
    let bounds =
        interval.map_or_else(String::new, |[low, high]| format!(" [{low:+.digits$}, {high:+.digits$}]"));
    format!("{value:+.digits$}{bounds}")
}

fn counts(of: &RateDifference) -> String {
    format!("{}, {}", of.gained, of.lost)
}
