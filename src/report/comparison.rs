//! Paired comparison of two runs, episode by episode, and its plain-text table.

use std::{collections::BTreeMap, fmt::Write};

use serde::Serialize;

use super::{
    stored_run::StoredRun,
    text_table::{WIDTH, shortened},
};
use crate::{
    evaluation::{
        paired_stats::{
            EpisodeKey, EpisodePair, MeanDifference, PairedComparison, RateDifference, TaskKey,
            group_by_task, pair_episodes,
        },
        record::EpisodeRecord,
        summary::method_label,
    },
    text::counted,
};

/// Width of a policy's name in the header, columns.
const POLICY_WIDTH: usize = 40;

/// Differences of one task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskDifferences {
    pub suite: String,
    pub task: usize,
    pub prompt: String,
    /// The second run minus the first.
    #[serde(flatten)]
    pub differences: PairedComparison,
}

/// Comparison of two runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Policy of the first run, with its privileged inputs.
    pub first: String,
    /// Policy of the second run.
    pub second: String,
    /// True if any target deforms.
    pub deformable: bool,
    /// Number of episodes present in only one run.
    pub unmatched: usize,
    /// Fields of `run.json`, other than the policy, in which the runs differ.
    pub unlike: Vec<String>,
    /// One sentence per run with missing episodes.
    pub partial: Vec<String>,
    /// Over all common episodes.
    pub all: PairedComparison,
    /// Per task, in order.
    pub by_task: Vec<TaskDifferences>,
}

/// Error of comparing two runs.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    #[error(
        "{first} and {second} both hold suite {suite} task {task} episode {episode}: compare one run per suite; give its folder"
    )]
    DuplicateEpisode { first: String, second: String, suite: String, task: usize, episode: u32 },
    #[error("{dir} has no episode yet")]
    Empty { dir: String },
    #[error("{first} and {second} share no episode: {reason}")]
    NoCommonEpisode { first: String, second: String, reason: String },
}

/// Compares the episodes common to `first` and `second`, each the runs of one folder, one per suite.
///
/// # Errors
/// An episode occurs twice on one side, or there is no common episode.
pub fn compare(first: &[StoredRun], second: &[StoredRun]) -> Result<Comparison, CompareError> {
    for runs in [first, second] {
        check_unique(runs)?;
    }
    let count = |runs: &[StoredRun]| -> usize { runs.iter().map(|run| run.records.len()).sum() };
    let pairs = pair_episodes(records(first), records(second));
    if pairs.is_empty() {
        return Err(no_common_episode(first, second));
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
        unlike: differing_fields(first, second),
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

/// Checks that no episode occurs twice, since one of the two would be ignored.
fn check_unique(runs: &[StoredRun]) -> Result<(), CompareError> {
    let mut known = BTreeMap::new();
    for run in runs {
        let dir = || run.dir.display().to_string();
        if run.records.is_empty() && runs.len() == 1 {
            return Err(CompareError::Empty { dir: dir() });
        }
        for record in &run.records {
            if let Some(other) = known.insert(EpisodeKey::of(record), &run.dir) {
                let id = &record.identity;
                return Err(CompareError::DuplicateEpisode {
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

/// A property of a run, as text.
type RunProperty = fn(&StoredRun) -> String;

/// The error about two runs without common episodes, with the property in which they differ.
fn no_common_episode(first: &[StoredRun], second: &[StoredRun]) -> CompareError {
    let of = |runs: &[StoredRun], property: RunProperty| {
        let mut values: Vec<String> = runs.iter().map(property).collect();
        values.sort();
        values.dedup();
        values
    };
    let fields: [(&str, RunProperty); 4] = [
        ("suite", |run| run.suite().to_owned()),
        ("seed", |run| run.manifest["seed"].to_string()),
        ("split", |run| run.text("split").to_owned()),
        ("tasks", |run| run.manifest["tasks"].to_string()),
    ];
    let differ = fields.iter().find_map(|(name, what)| {
        let (a, b) = (of(first, *what), of(second, *what));
        a.iter()
            .all(|value| !b.contains(value))
            .then(|| format!("{name} {} in the first, {} in the second", a.join(", "), b.join(", ")))
    });
    let dir = |runs: &[StoredRun]| runs.first().map_or_else(String::new, |run| run.dir.display().to_string());
    CompareError::NoCommonEpisode {
        first: dir(first),
        second: dir(second),
        reason: differ.unwrap_or_else(|| "their finished episodes do not overlap".to_owned()),
    }
}

fn name(runs: &[StoredRun]) -> String {
    let mut names: Vec<String> = runs
        .iter()
        .map(|run| method_label(run.text("policy"), run.is_privileged(), run.observes_forces()))
        .collect();
    names.sort();
    names.dedup();
    names.join(", ")
}

/// Fields of `run.json` about the conditions of a run in which two runs of one suite differ.
fn differing_fields(first: &[StoredRun], second: &[StoredRun]) -> Vec<String> {
    const CONDITION_FIELDS: [&str; 7] =
        ["softvt", "twin", "shifts", "options", "settings", "sources", "thresholds"];
    let mut found: Vec<String> = Vec::new();
    for a in first {
        let Some(b) = second.iter().find(|b| b.suite() == a.suite()) else { continue };
        found.extend(
            CONDITION_FIELDS
                .iter()
                .filter(|field| a.manifest[**field] != b.manifest[**field])
                .map(|f| (*f).to_owned()),
        );
    }
    found.sort();
    found.dedup();
    found
}

/// The comparison as a plain-text table of at most 100 columns.
pub fn table(comparison: &Comparison) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: &str| {
        let _ = writeln!(out, "{}", text.trim_end());
    };
    let rule = "─".repeat(WIDTH);
    let deformation =
        if comparison.deformable { DeformationComparison::Peak } else { DeformationComparison::None };
    line(&format!(
        "{} → {} · {}",
        shortened(&comparison.first, POLICY_WIDTH),
        shortened(&comparison.second, POLICY_WIDTH),
        counted(comparison.all.pairs, "paired episode")
    ));
    line(&rule);
    line(&headings("", ["first", "second"]));
    let mut suite = "";
    for task in &comparison.by_task {
        if task.suite != suite {
            suite = &task.suite;
            line(&rule);
            line(&shortened(suite, WIDTH));
        }
        let name = format!("{:>3} {}", task.task, task.prompt);
        measure_rows(&name, &task.differences, deformation).iter().for_each(|row| line(row));
    }
    line(&rule);
    measure_rows("all", &comparison.all, deformation).iter().for_each(|row| line(row));
    line(&rule);
    line(LEGEND);
    if comparison.unmatched > 0 {
        line(&format!(
            "{} present in only one run {} skipped",
            counted(comparison.unmatched, "episode"),
            if comparison.unmatched == 1 { "was" } else { "were" }
        ));
    }
    comparison.partial.iter().for_each(|remark| line(remark));
    if !comparison.unlike.is_empty() {
        line(&format!("the runs also differ in {} (run.json)", comparison.unlike.join(", ")));
    }
    out
}

/// Width of the name at the left, columns.
const NAME_WIDTH: usize = 29;

/// Legend of the rows.
pub(super) const LEGEND: &str = "diff.: second minus first · 95 % intervals: Agresti and Min for rates, bootstrap for D\nbetter, worse: number of episodes; a lower D is better · p: McNemar's exact test";

/// Deformation measure of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DeformationComparison {
    /// No target deforms.
    None,
    /// Peak D, % of the diagonal.
    Peak,
    /// Peak D over τ.
    OverTau,
}

/// The column headings.
pub(super) fn headings(name: &str, [first, second]: [&str; 2]) -> String {
    cells(name, ["", first, second, "diff.", "95 % interval", "better", "worse", "p"].map(str::to_owned))
}

/// One row per measure, the first with the name.
pub(super) fn measure_rows(
    name: &str,
    of: &PairedComparison,
    deformation: DeformationComparison,
) -> Vec<String> {
    let mut all =
        vec![rate("Goal, %", &of.goal), rate("NoDrop, %", &of.no_drop), rate("Safety, %", &of.safety)];
    match deformation {
        DeformationComparison::None => {}
        DeformationComparison::Peak => all.push(mean("D peak, %", &of.d_peak)),
        DeformationComparison::OverTau => all.push(mean("D peak/τ", &of.d_over_tau)),
    }
    let names = [name].into_iter().chain(std::iter::repeat(""));
    all.into_iter().zip(names).map(|(row, name)| cells(name, row)).collect()
}

fn rate(measure: &str, of: &RateDifference) -> [String; 8] {
    [
        measure.to_owned(),
        unsigned(of.first, 1),
        unsigned(of.second, 1),
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
        unsigned(of.first, 2),
        unsigned(of.second, 2),
        signed(of.difference, 2),
        interval(of.interval95, 2),
        of.better.to_string(),
        of.worse.to_string(),
        String::new(),
    ]
}

fn unsigned(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

fn signed(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:+.digits$}"))
}

fn interval(of: Option<[f64; 2]>, digits: usize) -> String {
    of.map_or_else(|| "–".to_owned(), |[low, high]| format!("[{low:+.digits$}, {high:+.digits$}]"))
}

fn cells(name: &str, cells: [String; 8]) -> String {
    let mut text = format!("{:<NAME_WIDTH$}", shortened(name, NAME_WIDTH));
    let [measure, rest @ ..] = cells;
    // Writing to a String cannot fail.
    let _ = write!(text, " {measure:<9}");
    for (cell, width) in rest.iter().zip([7, 8, 8, 18, 7, 6, 6]) {
        let _ = write!(text, "{cell:>width$}");
    }
    text.trim_end().to_owned()
}
