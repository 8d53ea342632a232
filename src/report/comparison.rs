//! What two runs differ in: the same episodes, one by one.

use std::{collections::BTreeMap, fmt::Write};

use serde::Serialize;

use super::{
    stored_run::StoredRun,
    text_table::{WIDTH, shortened},
};
use crate::evaluation::{
    paired_stats::{
        EpisodeKey, EpisodePair, MeanDifference, PairedComparison, RateDifference, TaskKey, group_by_task,
        pair_episodes,
    },
    record::EpisodeRecord,
    summary::method_label,
};

/// Columns of a policy's name at the head.
const POLICY: usize = 40;

/// One task of a suite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskDifferences {
    /// Suite.
    pub suite: String,
    /// Task index.
    pub task: usize,
    /// Instruction.
    pub prompt: String,
    /// Its differences: the second run minus the first.
    #[serde(flatten)]
    pub differences: PairedComparison,
}

/// Two runs compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// What the first is called, with what its policy has that no robot has.
    pub first: String,
    /// What the second is called.
    pub second: String,
    /// Whether something that is judged deforms.
    pub deformable: bool,
    /// Episodes that only one of them has.
    pub unmatched: usize,
    /// What the runs were not alike in besides their policies: paths of `run.json`.
    pub unlike: Vec<String>,
    /// Runs of which episodes are missing: a sentence each.
    pub partial: Vec<String>,
    /// All episodes that both have.
    pub all: PairedComparison,
    /// By task, in order.
    pub by_task: Vec<TaskDifferences>,
}

/// Why two runs cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A folder has an episode in two runs: nobody knows which one is meant.
    #[error(
        "{first} and {second} both hold suite {suite} task {task} episode {episode}: compare one run of a suite at a time; name its folder"
    )]
    Twice {
        /// A run's folder.
        first: String,
        /// Another's.
        second: String,
        /// Of the episode.
        suite: String,
        /// Of the episode.
        task: usize,
        /// Index.
        episode: u32,
    },
    /// A run has no episode yet.
    #[error("{dir} has no episode yet")]
    Empty {
        /// Its folder.
        dir: String,
    },
    /// They have no episode in common.
    #[error("{first} and {second} share no episode: {why}")]
    Nothing {
        /// The folder of one.
        first: String,
        /// The other's.
        second: String,
        /// In what their episodes differ.
        why: String,
    },
}

/// Compares the episodes that both have: `first` and `second` are the runs of two folders, of several suites each or of one.
///
/// # Errors
/// An episode is there twice on one side, or none is on both.
pub fn compare(first: &[StoredRun], second: &[StoredRun]) -> Result<Comparison, CompareError> {
    for runs in [first, second] {
        once(runs)?;
    }
    let count = |runs: &[StoredRun]| -> usize { runs.iter().map(|run| run.records.len()).sum() };
    let pairs = pair_episodes(records(first), records(second));
    if pairs.is_empty() {
        return Err(nothing(first, second));
    }
    let task = |(TaskKey { suite, task }, pairs): (TaskKey, Vec<EpisodePair>)| TaskDifferences {
        suite: suite.to_owned(),
        task,
        prompt: pairs[0].first.identity.prompt.clone(),
        differences: PairedComparison::of(&pairs),
    };
    let all = || first.iter().chain(second);
    Ok(Comparison {
        first: name(first),
        second: name(second),
        deformable: pairs.iter().any(|pair| pair.first.identity.soft),
        unmatched: count(first) + count(second) - 2 * pairs.len(),
        unlike: unlike(first, second),
        partial: all()
            .filter(|run| run.is_partial())
            .flat_map(|run| run.remarks().into_iter().take(1))
            .collect(),
        all: PairedComparison::of(&pairs),
        by_task: group_by_task(&pairs).into_iter().map(task).collect(),
    })
}

fn records(runs: &[StoredRun]) -> impl Iterator<Item = &EpisodeRecord> {
    runs.iter().flat_map(|run| &run.records)
}

/// No episode may be there twice: one of the two would be left out in silence.
fn once(runs: &[StoredRun]) -> Result<(), CompareError> {
    let mut known = BTreeMap::new();
    for run in runs {
        let dir = || run.dir.display().to_string();
        if run.records.is_empty() && runs.len() == 1 {
            return Err(CompareError::Empty { dir: dir() });
        }
        for record in &run.records {
            if let Some(other) = known.insert(EpisodeKey::of(record), &run.dir) {
                let id = &record.identity;
                return Err(CompareError::Twice {
                    first: other.display().to_string(),
                    second: dir(),
                    suite: id.suite.clone(),
                    task: id.task,
                    episode: id.episode,
                });
            }
        }
    }
    Ok(())
}

/// What a run says of itself.
type Said = fn(&StoredRun) -> String;

/// Says in what the episodes of two runs differ that have none in common.
fn nothing(first: &[StoredRun], second: &[StoredRun]) -> CompareError {
    let of = |runs: &[StoredRun], what: Said| {
        let mut values: Vec<String> = runs.iter().map(what).collect();
        values.sort();
        values.dedup();
        values
    };
    let fields: [(&str, Said); 4] = [
        ("suite", |run| run.suite().to_owned()),
        ("seed", |run| run.info["seed"].to_string()),
        ("split", |run| run.text("split").to_owned()),
        ("tasks", |run| run.info["tasks"].to_string()),
    ];
    let differ = fields.iter().find_map(|(name, what)| {
        let (a, b) = (of(first, *what), of(second, *what));
        a.iter()
            .all(|value| !b.contains(value))
            .then(|| format!("{name} {} there, {} here", a.join(", "), b.join(", ")))
    });
    let dir = |runs: &[StoredRun]| runs.first().map_or_else(String::new, |run| run.dir.display().to_string());
    CompareError::Nothing {
        first: dir(first),
        second: dir(second),
        why: differ.unwrap_or_else(|| "what is finished of them does not overlap".to_owned()),
    }
}

fn name(runs: &[StoredRun]) -> String {
    let mut names: Vec<String> = runs
        .iter()
        .map(|run| method_label(run.text("policy"), run.is_privileged(), run.sees_forces()))
        .collect();
    names.sort();
    names.dedup();
    names.join(", ")
}

/// Fields of `run.json` that say how a policy was judged, where two runs of one suite differ.
fn unlike(first: &[StoredRun], second: &[StoredRun]) -> Vec<String> {
    const JUDGED_BY: [&str; 7] = ["softvt", "twin", "shifts", "options", "settings", "sources", "thresholds"];
    let mut found: Vec<String> = Vec::new();
    for a in first {
        let Some(b) = second.iter().find(|b| b.suite() == a.suite()) else { continue };
        found.extend(
            JUDGED_BY.iter().filter(|field| a.info[**field] != b.info[**field]).map(|f| (*f).to_owned()),
        );
    }
    found.sort();
    found.dedup();
    found
}

/// The comparison as a table of at most 100 columns.
pub fn table(comparison: &Comparison) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: &str| {
        let _ = writeln!(out, "{}", text.trim_end());
    };
    let rule = "─".repeat(WIDTH);
    let deformation = if comparison.deformable { Deformation::Peak } else { Deformation::None };
    line(&format!(
        "{} → {} · {} paired episodes",
        shortened(&comparison.first, POLICY),
        shortened(&comparison.second, POLICY),
        comparison.all.pairs
    ));
    line(&rule);
    line(&head("", ["first", "second"]));
    let mut suite = "";
    for task in &comparison.by_task {
        if task.suite != suite {
            suite = &task.suite;
            line(&rule);
            line(&shortened(suite, WIDTH));
        }
        let name = format!("{:>3} {}", task.task, task.prompt);
        rows(&name, &task.differences, deformation).iter().for_each(|row| line(row));
    }
    line(&rule);
    rows("all", &comparison.all, deformation).iter().for_each(|row| line(row));
    line(&rule);
    line(KEY);
    if comparison.unmatched > 0 {
        line(&format!("{} episodes that only one run has are left out", comparison.unmatched));
    }
    comparison.partial.iter().for_each(|remark| line(remark));
    if !comparison.unlike.is_empty() {
        line(&format!("the runs also differ in {} (run.json)", comparison.unlike.join(", ")));
    }
    out
}

/// Columns of the name at the left.
const NAME: usize = 29;

/// What the rows say, to be written once below them.
pub(super) const KEY: &str = "difference: second minus first · 95 % intervals: Agresti and Min for rates, bootstrap for D\nbetter, worse: episodes; of D, less is better · p: McNemar's exact test";

/// Which deformation is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Deformation {
    /// Nothing deforms.
    None,
    /// Peak D, % of the diagonal.
    Peak,
    /// Peak D over τ.
    OverTau,
}

/// The heads of the columns.
pub(super) fn head(name: &str, [first, second]: [&str; 2]) -> String {
    cells(name, ["", first, second, "differ.", "95 % interval", "better", "worse", "p"].map(str::to_owned))
}

/// A row a measure, the first with the name.
pub(super) fn rows(name: &str, of: &PairedComparison, deformation: Deformation) -> Vec<String> {
    let mut all =
        vec![rate("Goal, %", &of.goal), rate("NoDrop, %", &of.no_drop), rate("Safety, %", &of.safety)];
    match deformation {
        Deformation::None => {}
        Deformation::Peak => all.push(mean("D peak, %", &of.d_peak)),
        Deformation::OverTau => all.push(mean("D peak/τ", &of.d_over_tau)),
    }
    let names = [name].into_iter().chain(std::iter::repeat(""));
    all.into_iter().zip(names).map(|(row, name)| cells(name, row)).collect()
}

fn rate(measure: &str, of: &RateDifference) -> [String; 8] {
    [
        measure.to_owned(),
        plain(of.first, 1),
        plain(of.second, 1),
        signed(of.difference, 1),
        interval(of.interval95, 1),
        of.better.to_string(),
        of.worse.to_string(),
        format!("{:.3}", of.p),
    ]
}

fn mean(measure: &str, of: &MeanDifference) -> [String; 8] {
    [
        measure.to_owned(),
        plain(of.first, 2),
        plain(of.second, 2),
        signed(of.difference, 2),
        interval(of.interval95, 2),
        of.better.to_string(),
        of.worse.to_string(),
        String::new(),
    ]
}

fn plain(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

fn signed(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:+.digits$}"))
}

fn interval(of: Option<[f64; 2]>, digits: usize) -> String {
    of.map_or_else(|| "–".to_owned(), |[low, high]| format!("[{low:+.digits$}, {high:+.digits$}]"))
}

fn cells(name: &str, cells: [String; 8]) -> String {
    let mut text = format!("{:<NAME$}", shortened(name, NAME));
    let [measure, rest @ ..] = cells;
    // Writing to a String cannot fail.
    let _ = write!(text, " {measure:<9}");
    for (cell, width) in rest.iter().zip([7, 8, 8, 18, 7, 6, 6]) {
        let _ = write!(text, "{cell:>width$}");
    }
    text.trim_end().to_owned()
}
