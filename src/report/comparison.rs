//! Paired comparison of two runs, episode by episode, and its plain-text table.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::{
    styled_text::{Emphasis, StyledText, TerminalFormat},
    task_names::{TaskName, task_names},
};
use softvt_common::text::{TextColumn, TextTable, counted, decimal, shortened};
use softvt_evaluation::stage::TaskStage;
use softvt_runs::{
    measures::{MEASURES, Measure, MeasureGroup},
    paired_stats::{
        EpisodeKey, EpisodePair, PairedComparison, PairedDifference, PairedStages, group_by_task,
        pair_episodes,
    },
    record::{EpisodeHeader, EpisodeRecord},
    stored_run::{StoredRun, records_as},
    summary::method_label,
};

/// Width of a policy's name in the header, columns.
const POLICY_WIDTH: usize = 27;

/// Differences of one task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskDifferences {
    /// Name of the suite.
    pub suite: String,
    /// Index of the task in the suite.
    pub task: usize,
    /// Instruction of the task.
    pub prompt: String,
    /// Asset of the object.
    pub asset: String,
    /// The second run minus the first.
    #[serde(flatten)]
    pub differences: PairedComparison,
}

impl TaskDifferences {
    fn name(&self) -> TaskName<'_> {
        TaskName { prompt: &self.prompt, asset: &self.asset }
    }
}

/// Comparison of two runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Policy of the first run, with its privileged inputs.
    pub first: String,
    /// Policy of the second run.
    pub second: String,
    /// Headings of both runs: their policies, or their folders if the policies have one name.
    pub headings: Vec<String>,
    /// True if any target deforms.
    pub deformable: bool,
    /// Number of episodes present in only one run.
    pub unpaired: usize,
    /// Fields of `run.json`, other than the policy, in which the runs differ.
    pub differing_fields: Vec<String>,
    /// Pairs of a suite and its rigid twin, one sentence per pair; empty for runs of the same suites.
    pub pairing: Vec<String>,
    /// One sentence per run with missing episodes.
    pub incomplete: Vec<String>,
    /// Over all common episodes.
    pub all: PairedComparison,
    /// Per task, in order.
    pub by_task: Vec<TaskDifferences>,
}

/// Error of comparing two runs.
#[allow(missing_docs, reason = "the messages describe the variants")]
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
    let (twins, mut pairing) = with_twins_paired(first, second);
    let [first, second] = &twins;
    let count = |runs: &[StoredRun]| -> usize { runs.iter().map(|run| run.records.len()).sum() };
    let pairs = pair_episodes(records(first), records(second));
    // A public seed may equal that of the results of a judged run, whose draws are others.
    let hashes = |runs: &[StoredRun]| runs.iter().map(seed_hash).collect::<BTreeSet<_>>();
    if pairs.is_empty() || hashes(first).is_disjoint(&hashes(second)) {
        return Err(no_common_episode(first, second));
    }
    pairing.extend(other_layouts(first, second));
    let task = |pairs: &[EpisodePair]| {
        let header @ EpisodeHeader { id, asset, .. } = &pairs[0].first.header;
        let differences = PairedComparison::from_pairs(pairs);
        let (suite, asset) = (id.suite.clone(), asset.clone());
        TaskDifferences { suite, task: id.task, prompt: header.task_prompt().to_owned(), asset, differences }
    };
    let all = || first.iter().chain(second);
    Ok(Comparison {
        first: policies(first),
        second: policies(second),
        headings: names(&[first, second]),
        deformable: pairs.iter().any(|pair| pair.first.has_soft_target()),
        unpaired: count(first) + count(second) - 2 * pairs.len(),
        differing_fields: differing_fields(first, second).into_iter().collect(),
        pairing,
        incomplete: all()
            .filter(|run| run.is_partial())
            .flat_map(|run| run.warnings().into_iter().take(1))
            .collect(),
        all: PairedComparison::from_pairs(&pairs),
        by_task: group_by_task(&pairs).map(task).collect(),
    })
}

/// A sentence about the episodes that both sides have in different layouts; they are not paired.
fn other_layouts(first: &[StoredRun], second: &[StoredRun]) -> Option<String> {
    let layouts: BTreeMap<_, _> =
        records(second).map(|record| (&record.header.id, record.header.layout.as_str())).collect();
    let mut differing = records(first).filter_map(|record| {
        let EpisodeHeader { id, layout, .. } = &record.header;
        let other = layouts.get(id).filter(|other| **other != layout.as_str())?;
        let place = format!("{} task {} episode {}", id.suite, id.task, id.episode);
        Some(format!("first: {place}, {layout} and {other}"))
    });
    let first = differing.next()?;
    let count = 1 + differing.count();
    let (episodes, are) = (counted(count, "episode"), if count == 1 { "is" } else { "are" });
    Some(format!("{episodes} that both runs have {are} not paired: the layouts differ ({first})"))
}

/// The runs, with the records of rigid twins under the name of the soft original if the other side has that: initial
/// states and prompts are the same. Also a sentence about each such pair.
fn with_twins_paired(first: &[StoredRun], second: &[StoredRun]) -> ([Vec<StoredRun>; 2], Vec<String>) {
    let mut sides = [first.to_vec(), second.to_vec()];
    let mut pairing = Vec::new();
    for (side, own, others) in [(0, first, second), (1, second, first)] {
        for run in sides[side].iter_mut().filter(|run| run.is_rigid_twin()) {
            let is_original =
                |other: &&StoredRun| !other.is_rigid_twin() && other.suite() == run.original_suite();
            // A folder with both has the original for the pair.
            if own.iter().any(|run| is_original(&run)) {
                continue;
            }
            let Some(original) = others.iter().find(is_original).map(|other| other.suite().to_owned()) else {
                continue;
            };
            pairing.push(format!(
                "{} is the rigid twin of {original}; their episodes are paired by task and episode",
                run.suite()
            ));
            run.records = records_as(&run.records, &original);
        }
    }
    (sides, pairing)
}

pub(super) fn records(runs: &[StoredRun]) -> impl Iterator<Item = &EpisodeRecord> {
    runs.iter().flat_map(|run| &run.records)
}

/// Checks that no episode occurs twice, since one of the two would be ignored.
pub(super) fn check_unique(runs: &[StoredRun]) -> Result<(), CompareError> {
    let mut known = BTreeMap::new();
    for run in runs {
        let dir = || run.dir.display().to_string();
        if run.records.is_empty() && runs.len() == 1 {
            return Err(CompareError::Empty { dir: dir() });
        }
        for record in &run.records {
            if let Some(other) = known.insert(EpisodeKey::new(record), &run.dir) {
                let id = &record.header.id;
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

/// Hash of the secret seed of a judged run.
fn seed_hash(run: &StoredRun) -> String {
    run.manifest.seed_hash.clone().unwrap_or_else(|| "none".to_owned())
}

/// The error about two runs without common episodes, with the property in which they differ.
pub(super) fn no_common_episode(first: &[StoredRun], second: &[StoredRun]) -> CompareError {
    type Property = fn(&StoredRun) -> String;
    let properties: [(&str, Property); 5] = [
        ("suite", |run| run.suite().to_owned()),
        ("seed hash", seed_hash),
        ("seed", |run| run.manifest.seed.to_string()),
        ("split", |run| run.manifest.split.name().to_owned()),
        ("tasks", |run| format!("{:?}", run.manifest.tasks)),
    ];
    let differing = properties.iter().find_map(|(name, property)| {
        let [a, b] = [first, second].map(|runs| runs.iter().map(property).collect::<BTreeSet<_>>());
        let describe = || format!("{name} {} in the first, {} in the second", joined(&a), joined(&b));
        a.is_disjoint(&b).then(describe)
    });
    let dir = |runs: &[StoredRun]| runs.first().map_or_else(String::new, |run| run.dir.display().to_string());
    CompareError::NoCommonEpisode {
        first: dir(first),
        second: dir(second),
        reason: differing.unwrap_or_else(|| "their finished episodes do not overlap".to_owned()),
    }
}

fn joined(names: &BTreeSet<String>) -> String {
    names.iter().map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// Policies of the runs, with their privileged inputs.
fn policies(runs: &[StoredRun]) -> String {
    let label = |run: &StoredRun| method_label(&run.manifest.policy, run.marks());
    joined(&runs.iter().map(label).collect())
}

/// Names of folders with runs that differ: their policies, or their own names.
pub(super) fn names(folders: &[impl AsRef<[StoredRun]>]) -> Vec<String> {
    let policy = |runs: &[StoredRun]| joined(&runs.iter().map(|run| run.manifest.policy.clone()).collect());
    let policies: Vec<String> = folders.iter().map(|runs| policy(runs.as_ref())).collect();
    let folder = |runs: &[StoredRun]| match runs {
        [run] => run.dir.clone(),
        // The runs of several suites are in one folder.
        _ => runs.first().and_then(|run| run.dir.parent()).map_or_else(PathBuf::new, Path::to_owned),
    };
    let name = |path: PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let own: Vec<String> =
        folders.iter().map(|runs| name(folder(runs.as_ref())).unwrap_or_default()).collect();
    let differ = |names: &&Vec<String>| names.iter().collect::<BTreeSet<_>>().len() == names.len();
    let numbered = || (1..=folders.len()).map(|number| format!("run {number}")).collect();
    [&policies, &own].into_iter().find(differ).cloned().unwrap_or_else(numbered)
}

/// Fields of `run.json` about the conditions of a run in which two runs of one suite differ.
pub(super) fn differing_fields(first: &[StoredRun], second: &[StoredRun]) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for a in first {
        let Some(b) = second.iter().find(|b| b.suite() == a.suite()) else { continue };
        found.extend(a.manifest.differing_conditions(&b.manifest));
    }
    found
}

/// One sentence for each run whose scripts or limits differ from those of the first run of its suite.
pub fn difference_warnings<'a>(runs: impl Iterator<Item = &'a StoredRun>) -> Vec<String> {
    let mut firsts: Vec<&StoredRun> = Vec::new();
    let mut warnings = Vec::new();
    for run in runs {
        let Some(first) = firsts.iter().find(|first| first.suite() == run.suite()) else {
            firsts.push(run);
            continue;
        };
        let fields = first.manifest.differing_files(&run.manifest).join(" and ");
        if !fields.is_empty() {
            warnings.push(format!(
                "{} and {} have different {fields}",
                first.dir.display(),
                run.dir.display()
            ));
        }
    }
    warnings
}

/// The headings within the width of a column: their beginnings, or their ends where the beginnings are the same.
fn distinct_headings(names: [&str; 2]) -> [String; 2] {
    let beginnings = names.map(|name| shortened(name, HEADING_WIDTH));
    if beginnings[0] != beginnings[1] {
        return beginnings;
    }
    let end = |name: &str| -> String {
        let letters = name.chars().rev().take(HEADING_WIDTH - 1).collect::<Vec<_>>();
        std::iter::once('…').chain(letters.into_iter().rev()).collect()
    };
    names.map(|name| if name.chars().count() > HEADING_WIDTH { end(name) } else { name.to_owned() })
}

/// The comparison as a table: all episodes first, then the tasks in which a rate changed. With details it has all
/// measures and all tasks.
pub fn table(comparison: &Comparison, format: TerminalFormat) -> String {
    let mut text = StyledText::new(format);
    let title = format!(
        "{} → {} · {}",
        shortened(&comparison.first, POLICY_WIDTH),
        shortened(&comparison.second, POLICY_WIDTH),
        counted(comparison.all.pairs, "paired episode")
    );
    text.line(Emphasis::Bold, title);
    let mut table = TextTable::new(COLUMNS);
    let [first, second] = distinct_headings([0, 1].map(|side| comparison.headings[side].as_str()));
    push_headings(&mut table, "", &first, &second);
    push_rates(&mut table, &comparison.all);
    if comparison.deformable {
        push_difference(&mut table, "D/limit", &comparison.all.d_over_tau, 2);
        push_difference(&mut table, "collapsed, %", &comparison.all.collapsed_volume_pct, 1);
    }
    for (name, difference) in &comparison.all.metrics {
        push_metric(&mut table, name, difference);
    }
    if format.has_details {
        push_details(&mut table, comparison.deformable, &comparison.all);
    }
    text.plain(&table.text);
    text.end();
    push_tasks(&mut text, comparison, format);
    push_notes(&mut text, comparison, format);
    text.into_text()
}

/// One line per task in which a rate changed, or per task with details.
fn push_tasks(text: &mut StyledText, comparison: &Comparison, format: TerminalFormat) {
    let named: Vec<TaskName> = comparison.by_task.iter().map(TaskDifferences::name).collect();
    let has_changed = |paired: &PairedComparison| {
        [paired.goal, paired.no_drop, paired.safety].iter().any(|rate| rate.better + rate.worse > 0)
    };
    let all: Vec<(&TaskDifferences, String)> = comparison.by_task.iter().zip(task_names(&named)).collect();
    let is_shown = |task: &TaskDifferences| format.has_details || has_changed(&task.differences);
    let shown = all.iter().filter(|(task, _)| is_shown(task));
    let mut table = TextTable::new([
        TextColumn::Right(3),
        TextColumn::Left(format.width.saturating_sub(1 + 57).clamp(14, 40)),
        TextColumn::Right(16),
        TextColumn::Right(16),
        TextColumn::Right(18),
    ]);
    let mut suite = "";
    table.row(["#", "task", "Goal, %", "Safety, %", "D/limit"]);
    let headings = table.text.len();
    for (task, name) in shown {
        if task.suite != suite && comparison.by_task.iter().any(|other| other.suite != task.suite) {
            table.line(shortened(&task.suite, TextTable::WIDTH));
        }
        suite = &task.suite;
        let PairedComparison { goal, safety, d_over_tau, .. } = &task.differences;
        let change = |of: &PairedDifference, digits: usize| match of.n {
            0 => "N/A".to_owned(),
            _ => format!("{} → {}", decimal(of.first, digits), decimal(of.second, digits)),
        };
        let [goal, safety] = [goal, safety].map(|rate| change(rate, 0));
        table.row([task.task.to_string(), name.clone(), goal, safety, change(d_over_tau, 2)]);
    }
    if table.text.len() > headings {
        text.plain(&table.text);
    }
    let hidden = all.iter().filter(|(task, _)| !is_shown(task)).count();
    if hidden > 0 {
        let them = format!("{} with the same rates; --details shows all", counted(hidden, "task"));
        text.line(Emphasis::Faint, them);
    }
    text.end();
}

/// What the numbers mean, and what reduces their meaning.
fn push_notes(text: &mut StyledText, comparison: &Comparison, format: TerminalFormat) {
    let mut note = |sentence: &str| text.wrapped(sentence, format.width - 1);
    note(LEGEND);
    note("Goal is TSR · D/limit: peak D over τ · N/A: no pair of episodes has it in both runs");
    if format.has_details {
        note("DSR: goal with D within τ · failed: better where more stages were completed");
    }
    note(&e_values(&comparison.all));
    if comparison.all.invalid_pairs > 0 {
        note(&format!(
            "{} with an invalid episode: failed in success rates; without D, time over τ and volumes",
            counted(comparison.all.invalid_pairs, "pair")
        ));
    }
    if comparison.unpaired > 0 {
        let verb = if comparison.unpaired == 1 { "was" } else { "were" };
        let episodes = counted(comparison.unpaired, "episode");
        note(&format!("{episodes} present in only one run {verb} skipped"));
    }
    comparison.pairing.iter().chain(&comparison.incomplete).for_each(|sentence| note(sentence));
    if !comparison.differing_fields.is_empty() {
        note(&format!("the runs also differ in {} (run.json)", comparison.differing_fields.join(", ")));
    }
}

/// Width of a run's name in the headings, columns.
const HEADING_WIDTH: usize = 8;

/// Width of the name of a measure, columns.
const NAME_WIDTH: usize = 18;

/// Columns of a table of differences: measure, both values, difference, better, worse, interval and p.
pub(super) const COLUMNS: [TextColumn; 8] = {
    use TextColumn::{Left, Right};
    [
        Left(NAME_WIDTH),
        Right(HEADING_WIDTH),
        Right(HEADING_WIDTH),
        Right(7),
        Right(6),
        Right(5),
        Right(16),
        Right(4),
    ]
};

/// Measures in the table without details.
const MAIN_MEASURES: [&str; 5] = ["goal", "no_drop", "safety", "d_over_tau", "collapsed_volume_pct"];

/// Appends the rows that only the table of all episodes has.
fn push_details(table: &mut TextTable, deformable: bool, paired: &PairedComparison) {
    let is_of_soft = |measure: &Measure| {
        matches!(measure.group, MeasureGroup::Deformation | MeasureGroup::Volume) || measure.paired == Some("dsr")
    };
    let further = MEASURES.iter().filter(|measure| !MAIN_MEASURES.map(Some).contains(&measure.paired));
    for measure in further.filter(|measure| deformable || !is_of_soft(measure)) {
        if let Some(difference) = (measure.difference)(paired) {
            push_difference(table, &measure.label(), &difference, measure.digits);
        }
    }
    push_stages(table, &paired.failed_stages);
}

/// Appends the number of failed episodes, in total and by stage.
fn push_stages(table: &mut TextTable, stages: &PairedStages) {
    const FAILED: &str = "failed episodes";
    if stages.n == 0 {
        return table.row([FAILED, "N/A", "N/A"]);
    }
    let counts = |name: String, first: usize, second: usize| {
        let difference = second as f64 - first as f64;
        [name, first.to_string(), second.to_string(), signed(Some(difference), 0)]
    };
    let [first, second] = [&stages.first, &stages.second];
    let total = counts(FAILED.to_owned(), first.values().sum(), second.values().sum());
    table.row(total.into_iter().chain([stages.better.to_string(), stages.worse.to_string()]));
    for stage in TaskStage::ALL {
        let [first, second] = [first, second].map(|of| of.get(&stage).copied().unwrap_or(0));
        if first + second > 0 {
            table.row(counts(format!("  {}", stage.name()), first, second));
        }
    }
}

/// Legend of the columns.
pub(super) const LEGEND: &str = "diff.: right minus left · better, worse: number of episodes; a lower D is better · 95 % intervals: Agresti and Min for rates, bootstrap for others (n≥10) · p: McNemar's exact test of rates, Wilcoxon's signed-rank test of others";

/// Appends the column headings, with `name` above the names of the rows.
pub(super) fn push_headings(table: &mut TextTable, name: &str, first: &str, second: &str) {
    table.row([name, first, second, "diff.", "better", "worse", "95 % interval", "p"]);
}

/// Appends one row per rate.
pub(super) fn push_rates(table: &mut TextTable, paired: &PairedComparison) {
    for (name, rate) in
        [("Goal, %", paired.goal), ("NoDrop, %", paired.no_drop), ("Safety, %", paired.safety)]
    {
        push_difference(table, name, &rate, 1);
    }
}

/// Appends a row with `digits` decimals, or N/A without a pair that has the quantity. One pair has no interval.
pub(super) fn push_difference(table: &mut TextTable, name: &str, paired: &PairedDifference, digits: usize) {
    let counts = [paired.better, paired.worse].map(|count| count.to_string());
    push_row(table, name, paired, digits, counts);
}

/// Appends the row of a metric of the suite, of which it is not known whether less is better.
fn push_metric(table: &mut TextTable, name: &str, paired: &PairedDifference) {
    push_row(table, &shortened(name, NAME_WIDTH), paired, 3, Default::default());
}

fn push_row(
    table: &mut TextTable,
    name: &str,
    paired: &PairedDifference,
    digits: usize,
    counts: [String; 2],
) {
    if paired.n == 0 {
        return table.row([name, "N/A", "N/A"]);
    }
    let values = [
        name.to_owned(),
        decimal(paired.first, digits),
        decimal(paired.second, digits),
        signed(paired.difference, digits),
    ];
    let interval = interval(paired.interval95.filter(|_| paired.n > 1), digits);
    table.row(values.into_iter().chain(counts).chain([interval]).chain(paired.p.map(probability)));
}

/// The e-values of the rates, which a reader who watches a run may use.
fn e_values(paired: &PairedComparison) -> String {
    let rates = [("Goal", paired.goal), ("NoDrop", paired.no_drop), ("Safety", paired.safety)];
    let known = rates.iter().filter_map(|(name, rate)| Some(format!("{name} {}", e_value_text(rate.e?))));
    let known: Vec<String> = known.collect();
    format!("e-values: {} · 20 is 5 %, also if runs are continued until then", known.join(", "))
}

fn e_value_text(e: f64) -> String {
    if e >= 1e4 { format!("{e:.1e}") } else { format!("{e:.2}") }
}

/// A p-value with three decimals, without the zero before them.
fn probability(p: f64) -> String {
    match p {
        p if p < 0.001 => "<.001".to_owned(),
        p if p > 0.9995 => "1".to_owned(),
        p => format!("{p:.3}").trim_start_matches('0').to_owned(),
    }
}

pub(super) fn signed(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:+.digits$}").replace('-', "−"))
}

pub(super) fn interval(bounds: Option<[f64; 2]>, digits: usize) -> String {
    bounds.map_or_else(
        || "–".to_owned(),
        |[low, high]| format!("[{}, {}]", signed(Some(low), digits), signed(Some(high), digits)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::policy_ranking::PolicyRanking;
    use crate::{run_summary::tests::stored, sample_record};
    use softvt_evaluation::verdict::{InvalidReason, Outcome, WrongObjectContact};

    /// A run of three episodes with these stages of failure.
    fn run(dir: &str, d_mean: f64, stages: [Option<TaskStage>; 3]) -> StoredRun {
        let record = |(episode, failed_stage): (usize, Option<TaskStage>)| {
            let mut record = sample_record();
            record.header.id.episode = episode as u32;
            let v = &mut record.verdict;
            (v.goal, v.failed_stage) = (failed_stage.is_none(), failed_stage);
            (v.others_ok, v.gentle) = (Some(true), d_mean < 0.3);
            let of = v.object_mut();
            (of.d_mean, of.d_final, of.d_p95) = (Some(d_mean), Some(0.1), Some(0.3));
            (of.time_over_tau_s, of.grip_ratio) = (Some(0.5), Some(10.0 * d_mean));
            record
        };
        stored(dir, "pi", stages.into_iter().enumerate().map(record).collect())
    }

    /// The cells of a row by the start of its name.
    fn words(text: &str, name: &str) -> Vec<String> {
        let row = text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_default();
        let cells = row.trim_start().trim_start_matches(name).split_whitespace();
        cells.map(str::to_owned).collect()
    }

    #[test]
    fn headings_of_two_policies_differ_where_their_names_do() {
        let of = |first: &str, second: &str| distinct_headings([first, second]);
        assert_eq!(of("expert", "noop"), ["expert", "noop"]);
        assert_eq!(of("tactile-servo", "expert-binary"), ["tactile…", "expert-…"]);
        assert_eq!(of("policy_of_a", "policy_of_b"), ["…cy_of_a", "…cy_of_b"]);
    }

    #[test]
    fn the_table_has_the_rows_of_the_summary() {
        let first = run("a", 0.25, [Some(TaskStage::Reach), Some(TaskStage::Grasp), None]);
        let mut second = run("b", 0.5, [Some(TaskStage::Carry), None, None]);
        second.records[0].verdict.first_wrong_contact =
            Some(WrongObjectContact { time_s: 1.0, object: "bun".to_owned() });
        second.records[2].outcome = Outcome::Invalid { reason: InvalidReason::Inverted, step: 3, node: None };
        let compared = compare(&[first], &[second]).expect("the same episodes");
        let text = table(&compared, TerminalFormat::PLAIN.with_details());
        assert!(text.lines().all(|line| line.chars().count() < 80), "{text}");
        assert_eq!(words(&text, "D mean, %"), ["0.25", "0.50", "+0.25", "0", "2", "–", ".500"], "{text}");
        assert_eq!(words(&text, "D final, %")[..3], ["0.10", "0.10", "+0.00"]);
        assert_eq!(words(&text, "D P95, %")[..3], ["0.30", "0.30", "+0.00"]);
        assert_eq!(words(&text, "time over τ, s")[..3], ["0.50", "0.50", "+0.00"]);
        assert_eq!(words(&text, "collapsed, %")[..2], ["1.2", "1.2"]);
        assert_eq!(words(&text, "damaged, %")[..2], ["0.5", "0.5"]);
        assert_eq!(words(&text, "gentle, %")[..3], ["100.0", "0.0", "−100.0"]);
        assert_eq!(words(&text, "grip ratio")[..3], ["2.5", "5.0", "+2.5"]);
        assert_eq!(words(&text, "others within τ, %")[..2], ["100.0", "100.0"]);
        let touched = words(&text, "touched others, %");
        assert_eq!(touched[..3], ["0.0", "33.3", "+33.3"]);
        assert_eq!(touched[3..5], ["0", "1"]);
        assert_eq!(words(&text, "failed episodes"), ["2", "1", "−1", "2", "0"]);
        assert_eq!(words(&text, "reach"), ["1", "0", "−1"]);
        assert_eq!(words(&text, "carry"), ["0", "1", "+1"]);
        assert!(words(&text, "place").is_empty(), "{text}");
        assert!(text.contains("1 pair with an invalid episode: failed in success rates"), "{text}");
    }

    #[test]
    fn differing_files_and_limits_of_runs_are_named() {
        let (whole, mut part) = (run("a", 0.25, [None; 3]), run("b", 0.25, [None; 3]));
        part.manifest.sources.insert("x.lua".to_owned(), "9".to_owned());
        part.manifest.thresholds.insert("bun".to_owned(), Some(1.5));
        let fields = ["sources (x.lua)", "thresholds (bun)"];
        assert_eq!(
            compare(std::slice::from_ref(&whole), std::slice::from_ref(&part))
                .expect("pairs")
                .differing_fields,
            fields
        );
        let warnings = difference_warnings([&whole, &part, &whole].into_iter());
        assert_eq!(warnings, ["a and b have different sources (x.lua) and thresholds (bun)"]);
        let three = PolicyRanking::new(&[&whole, &whole, &part].map(|run| vec![run.clone()]))
            .expect("common episodes");
        assert_eq!(three.differing_fields, fields);
        assert!(
            three.table().contains("the runs also differ in sources (x.lua), thresholds (bun) (run.json)")
        );
    }

    #[test]
    fn episodes_of_other_layouts_are_said_not_to_be_paired() {
        let (a, mut b) = (run("a", 0.25, [None; 3]), run("b", 0.25, [None; 3]));
        let own = a.records[1].header.layout.clone();
        b.records[1].header.layout = "other".to_owned();
        let compared = compare(std::slice::from_ref(&a), std::slice::from_ref(&b)).expect("pairs");
        assert_eq!((compared.all.pairs, compared.unpaired), (2, 2));
        let sentence = "1 episode that both runs have is not paired: the layouts differ (first: ";
        assert!(compared.pairing[0].starts_with(sentence), "{:?}", compared.pairing);
        assert!(compared.pairing[0].ends_with(&format!(", {own} and other)")), "{:?}", compared.pairing);
        assert_eq!(
            compare(std::slice::from_ref(&a), std::slice::from_ref(&a)).expect("pairs").pairing,
            [""; 0]
        );
    }

    #[test]
    fn columns_have_the_names_of_the_runs() {
        let heads = |a: &StoredRun, b: &StoredRun| {
            compare(std::slice::from_ref(a), std::slice::from_ref(b)).expect("pairs").headings
        };
        let (a, mut b) = (run("runs/a", 0.25, [None; 3]), run("runs/b", 0.25, [None; 3]));
        assert_eq!(heads(&a, &b), ["a", "b"], "one policy in two folders");
        b.manifest.policy = "servo".to_owned();
        assert_eq!(heads(&a, &b), ["pi", "servo"]);
        let text = table(&compare(&[a], &[b]).expect("pairs"), TerminalFormat::PLAIN);
        let head: Vec<&str> = text.lines().nth(1).unwrap_or_default().split_whitespace().collect();
        assert_eq!(head[..3], ["pi", "servo", "diff."], "{text}");
    }

    #[test]
    fn small_probabilities_are_bounds() {
        assert_eq!([0.25, 0.001, 0.0009, 0.0].map(probability), [".250", ".001", "<.001", "<.001"]);
    }
}
