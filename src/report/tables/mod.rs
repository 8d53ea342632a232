//! Result tables of runs, which [`formats`] writes as Markdown and LaTeX, and the page as HTML.

pub mod formats;

use std::collections::{BTreeMap, BTreeSet};

use super::{
    cells::{percentile, rate, tau_range},
    condition_effects::{condition_effects, effects_table},
    run_summary::RunSummary,
};
use softvt_benchmark::NeededKnowledge;
use softvt_common::{
    table::{Column, Table},
    text::{decimal, significant},
};
use softvt_evaluation::{safety::KAPPAS, stage::TaskStage, statistics::Distribution};
use softvt_runs::{
    measures::{MEASURES, Measure, MeasureGroup, Score},
    summary::{CommandCounts, GroupScores, TaskScores},
};

/// A column of a table with a row per run.
type RunColumn<'a> = Column<'a, RunSummary>;

/// Number of episodes, and of how many if the run is not finished.
fn episodes(run: &RunSummary) -> String {
    let count = run.run.records.len();
    if run.run.is_partial() {
        format!("{count} of {}", run.run.manifest.requested_episodes())
    } else {
        count.to_string()
    }
}

fn score<'a>(heading: impl Into<String>, cell: impl Fn(&GroupScores) -> String + 'a) -> RunColumn<'a> {
    Column::number(heading, move |run: &RunSummary| cell(&run.summary.scores))
}

/// A table with a row per run, with the names of its suite and method; `None` without a run.
fn table_of<'a>(
    runs: impl IntoIterator<Item = &'a RunSummary>,
    caption: &str,
    columns: impl IntoIterator<Item = RunColumn<'a>>,
) -> Option<Table> {
    let names: [RunColumn; 2] = [
        Column::text("Suite", |run: &RunSummary| run.summary.suite.clone()),
        Column::text("Method", |run: &RunSummary| run.method.clone()),
    ];
    let table = Table::new(runs, names.into_iter().chain(columns)).with_caption(caption);
    (!table.rows.is_empty()).then_some(table)
}

fn soft(runs: &[RunSummary]) -> impl Iterator<Item = &RunSummary> {
    runs.iter().filter(|run| run.is_soft())
}

/// Needs of a safe grip in the suites that state them: "A safe grip needs size in: object_varied."
fn needs(runs: &[RunSummary]) -> String {
    let mut suites: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for run in runs {
        if let Some(needs) = run.run.manifest.needs {
            let words = match needs {
                NeededKnowledge::Nothing => "nothing",
                NeededKnowledge::Size => "size",
                NeededKnowledge::Trial => "to be found by trial",
            };
            suites.entry(words).or_default().insert(&run.summary.suite);
        }
    }
    let sentence = |(needs, suites): (&str, BTreeSet<&str>)| {
        let names: Vec<&str> = suites.into_iter().collect();
        format!(" A safe grip needs {needs} in: {}.", names.join(", "))
    };
    suites.into_iter().map(sentence).collect()
}

/// The paper's main table: Goal and Safety Success by suite and method.
pub fn main_table(runs: &[RunSummary]) -> Table {
    let with_slip: Vec<String> =
        runs.iter().filter(|run| run.summary.no_slip_required).map(RunSummary::name).collect();
    let slip = match with_slip.is_empty() {
        true => String::new(),
        false => format!(" It also requires no slip in the hand in: {}.", with_slip.join("; ")),
    };
    let needs = needs(runs);
    let caption = format!(
        "Success by suite and method, % of episodes with 95 % Wilson intervals. Safety Success requires the goal, no drop, and a peak deformation within the object's threshold; it does not apply to rigid objects.{slip}{needs} TSR is Goal Success; DSR is Goal Success with the deformation within the threshold, dropped or not."
    );
    let columns = [
        Column::number("Episodes", episodes),
        score("Goal Success (TSR)", |s| rate(&s.goal_success_rate)),
        score("NoDrop", |s| rate(&s.no_drop_rate)),
        score("Safety Success", |s| rate(&s.safety_success_rate)),
        score("Gap, pp", |s| decimal(s.goal_safe_gap, 1)),
        score("Invalid", |s| s.invalid.to_string()),
        score("DSR", |s| rate(&s.dsr.unwrap_or_default())),
        score("Not judged", |s| s.not_judged.to_string()),
    ];
    table_of(runs, &caption, columns).unwrap_or_default()
}

type Statistic = (&'static str, fn(&Distribution) -> Option<f64>);

const MEAN: Statistic = ("mean", |of| of.mean);
const P5: Statistic = ("P5", |of| of.p5);
const MEDIAN: Statistic = ("median", |of| of.median);
const P95: Statistic = ("P95", |of| of.p95);

/// The columns of measures: one of a rate or a mean, and one per statistic of a distribution.
fn measure_columns<'a>(
    measures: impl Iterator<Item = &'static Measure>,
    statistics: &'a [Statistic],
) -> Vec<RunColumn<'a>> {
    let columns = |measure: &'static Measure| {
        let mut name = measure.heading.to_owned();
        name[..1].make_ascii_uppercase();
        if matches!((measure.score)(&GroupScores::from_records(&[])), Some(Score::Distribution(_))) {
            let column = |(of, value): &Statistic| {
                let value = *value;
                score(format!("{name}, {of}"), move |scores| match (measure.score)(scores) {
                    Some(Score::Distribution(of)) => decimal(value(&of), 2),
                    _ => "–".to_owned(),
                })
            };
            return statistics.iter().map(column).collect();
        }
        vec![Column::number(name, move |run: &RunSummary| match (measure.score)(run.scores()) {
            Some(Score::Rate(of)) => rate(&of),
            Some(Score::Mean(mean)) => decimal(mean, 2),
            Some(Score::Distribution(_)) | None => "–".to_owned(),
        })]
    };
    measures.flat_map(columns).collect()
}

/// The paper's deformation table; `None` if all suites are rigid.
pub fn deformation_table(runs: &[RunSummary]) -> Option<Table> {
    let percentile_of = |heading, of: fn(&Distribution) -> Option<f64>| {
        score(heading, move |s| percentile(&s.deformation, of(&s.deformation)))
    };
    let peaks = [
        score("Mean", |s| decimal(s.deformation.mean, 2)),
        percentile_of("P5", |d| d.p5),
        percentile_of("Median", |d| d.median),
        percentile_of("P95", |d| d.p95),
        score("Valid", |s| s.deformation.n.to_string()),
        score("Invalid", |s| s.deformation.invalid.to_string()),
    ];
    let within = MEASURES.iter().filter(|measure| measure.within.is_some());
    table_of(
        soft(runs),
        "Peak FEM-RMS deformation, % of the settled bounding-box diagonal. The mean is over the valid episodes; percentiles are over all, with invalid ones ranked as worst (∞). On the right, deformation within an episode, averaged over the valid ones; the time over τ in s.",
        peaks.into_iter().chain(measure_columns(within, &[])),
    )
}

/// Contact success and the grip ratio; `None` without a run.
pub fn grip_table(runs: &[RunSummary]) -> Option<Table> {
    let measures = measure_columns(Measure::of(MeasureGroup::Grip), &[P5, MEDIAN, P95]);
    table_of(
        runs,
        "Grip, % of episodes. Contact success is Goal Success with contact of both pads throughout the carry; contact safety is contact success with Safety Success and no slip of more than the limit. The grip ratio is the largest force on a pad over the least that holds the object on its path, over the valid episodes in which it was carried; gentle is Goal Success with a ratio of at most 2, unless the settings state another.",
        measures.into_iter().chain([score("Episodes", |s| s.grip_ratio.n.to_string())]),
    )
}

/// Metrics of the suites; `None` without any.
pub fn metric_table(runs: &[RunSummary]) -> Option<Table> {
    type Metric<'a> = (&'a RunSummary, &'a str, &'a Distribution);
    let of_run = |run| {
        let metrics: &'_ BTreeMap<String, Distribution> = &RunSummary::scores(run).metrics;
        metrics.iter().map(move |(name, of)| (run, name.as_str(), of))
    };
    let rows: Vec<Metric> = runs.iter().flat_map(of_run).collect();
    let number = |heading, of: fn(&Distribution) -> Option<f64>| {
        Column::number(heading, move |(_, _, metric): &Metric| {
            of(metric).map_or_else(|| "–".to_owned(), |value| significant(value, 4))
        })
    };
    let columns = [
        Column::text("Suite", |(run, ..): &Metric| run.summary.suite.clone()),
        Column::text("Method: metric", |(run, name, _): &Metric| format!("{}: {name}", run.method)),
        number("Mean", |of| of.mean),
        number("P5", |of| of.p5),
        number("Median", |of| of.median),
        number("P95", |of| of.p95),
        Column::number("Episodes", |(_, _, of): &Metric| of.n.to_string()),
    ];
    let table = Table::new(&rows, columns);
    (!rows.is_empty())
        .then(|| table.with_caption("Metrics of the suites over the valid episodes that have them."))
}

/// Volume of the target beyond the strain limits of its material; `None` if no material states them.
pub fn crushed_table(runs: &[RunSummary]) -> Option<Table> {
    let is_stated =
        |run: &RunSummary| run.scores().collapsed_volume.n > 0 || run.scores().damaged_volume.n > 0;
    let measures = measure_columns(Measure::of(MeasureGroup::Volume), &[MEAN, MEDIAN, P95]);
    let table = table_of(
        soft(runs),
        "Volume of the object beyond the strain limits of its material over all valid episodes, %: the largest share beyond the collapse strain at one time, and the share that was ever beyond the damage strain.",
        measures.into_iter().chain([score("Episodes", |s| s.collapsed_volume.n.to_string())]),
    );
    table.filter(|_| runs.iter().any(is_stated))
}

/// Safety Success at several κ; `None` if all suites are rigid.
pub fn kappa_table(runs: &[RunSummary]) -> Option<Table> {
    let at = |kappa: f64| {
        Column::number(format!("κ = {kappa}"), move |run: &RunSummary| {
            let known = run.summary.kappa.iter().find(|row| row.kappa == kappa);
            known.map_or_else(|| "–".to_owned(), |row| rate(&row.safety_success_rate))
        })
    };
    table_of(
        soft(runs),
        "Safety Success, % of episodes, where the threshold is κ times D_ref (0.5 is nominal).",
        KAPPAS.map(at),
    )
}

pub fn task_table(run: &RunSummary) -> Table {
    let score = |heading, cell: fn(&GroupScores) -> String| {
        Column::number(heading, move |task: &TaskScores| cell(&task.scores))
    };
    let soft = |heading, cell: fn(&GroupScores) -> Option<String>| {
        let is_soft = run.is_soft();
        Column::number(heading, move |task: &TaskScores| {
            let cell = Some(&task.scores).filter(|_| is_soft).and_then(cell);
            cell.unwrap_or_else(|| "N/A".to_owned())
        })
    };
    let columns = [
        Column::text("Task", |task: &TaskScores| task.task.to_string()),
        Column::text("Prompt", |task: &TaskScores| format!("{} ({})", task.prompt, task.asset)),
        score("Episodes", |s| s.episodes.to_string()),
        score("Goal", |s| rate(&s.goal_success_rate)),
        score("NoDrop", |s| rate(&s.no_drop_rate)),
        score("Safety", |s| rate(&s.safety_success_rate)),
        soft("D median, %", |s| Some(percentile(&s.deformation, s.deformation.median))),
        soft("τ, %", |s| s.tau_range.map(|_| tau_range(s.tau_range))),
    ];
    Table::new(&run.summary.by_task, columns).with_caption(format!(
        "{}: per task, with the asset of the object, % of episodes with 95 % Wilson intervals.",
        run.name()
    ))
}

/// Harm to other objects, and the stages at which episodes failed; `None` without a run.
pub fn stage_table(runs: &[RunSummary]) -> Option<Table> {
    let unknown = std::iter::once(score("Others unknown", |s| s.others_unknown.to_string()));
    let harm = measure_columns(Measure::of(MeasureGroup::Harm), &[]);
    let stages = TaskStage::ALL.map(|stage| {
        score(stage.name(), move |s| s.failed_stages.get(&stage).copied().unwrap_or(0).to_string())
    });
    table_of(
        runs,
        "Harm to other objects, % of episodes, with the number of episodes in which harm to others within their τ is unknown; and the number of episodes without Goal Success by the stage at which they ended.",
        unknown.chain(harm).chain(stages),
    )
}

/// Commands that were not executed as given; `None` without any.
pub fn command_table(runs: &[RunSummary]) -> Option<Table> {
    let count = |heading, of: fn(&CommandCounts) -> u64| {
        Column::number(heading, move |run: &RunSummary| of(&run.summary.commands).to_string())
    };
    let first = |run: &RunSummary| {
        run.summary.commands.first_far.map_or_else(|| "–".to_owned(), |first| first.to_string())
    };
    let is_affected = |run: &&RunSummary| {
        let commands = &run.summary.commands;
        commands.far + commands.clamped_grips + commands.clamped_steps > 0
    };
    table_of(
        runs.iter().filter(is_affected),
        "Commands that were not executed as given: poses out of reach of one control step, and grip values and displacements out of their range, which are clamped. Many of them mean another unit or frame.",
        [
            count("Commands", |c| c.steps),
            count("Out of reach", |c| c.far),
            count("Episodes", |c| c.far_episodes as u64),
            count("Grips out of range", |c| c.clamped_grips),
            count("Episodes", |c| c.clamped_episodes as u64),
            count("Displacements out of range", |c| c.clamped_steps),
            count("Episodes", |c| c.clamped_step_episodes as u64),
            Column::number("First out of reach", first),
        ],
    )
}

/// Task-stratified bootstrap intervals of the rates and of the mean D; `None` if no run has enough episodes.
pub fn bootstrap_table(runs: &[RunSummary]) -> Option<Table> {
    let bounds = |heading, digits: usize, of: fn(&GroupScores) -> Option<[f64; 2]>| {
        score(heading, move |s| match of(s) {
            Some([low, high]) => format!("{low:.digits$} to {high:.digits$}"),
            None => "–".to_owned(),
        })
    };
    table_of(
        runs.iter().filter(|run| run.scores().tsr.bootstrap95.is_some()),
        "95 % intervals by the bootstrap within tasks, %: in addition to the Wilson intervals, which take all episodes as independent.",
        [
            bounds("TSR", 1, |s| s.tsr.bootstrap95),
            bounds("NoDrop", 1, |s| s.no_drop_rate.bootstrap95),
            bounds("Safety Success", 1, |s| s.safety_success_rate.bootstrap95),
            bounds("DSR", 1, |s| s.dsr.and_then(|dsr| dsr.bootstrap95)),
            bounds("D mean", 2, |s| s.deformation.bootstrap95),
        ],
    )
}

pub fn all_tables(runs: &[RunSummary]) -> Vec<Table> {
    let optional = [
        effects_table(&condition_effects(runs)),
        deformation_table(runs),
        crushed_table(runs),
        grip_table(runs),
        metric_table(runs),
        kappa_table(runs),
        stage_table(runs),
        command_table(runs),
        bootstrap_table(runs),
    ];
    let first = std::iter::once(main_table(runs));
    first.chain(optional.into_iter().flatten()).chain(runs.iter().map(task_table)).collect()
}
