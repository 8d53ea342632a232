//! Result tables of runs, as markdown and as LaTeX with booktabs. Names come from scripts and are escaped.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    condition_effects::{condition_effects, effects_table},
    run_summary::RunSummary,
    terminal::{percentile, tau_range},
};
use softvt_benchmark::NeededKnowledge;
use softvt_common::text::{decimal, significant};
use softvt_evaluation::{
    safety::KAPPAS,
    stage::TaskStage,
    statistics::{Distribution, Rate},
};
use softvt_runs::{
    measures::{MEASURES, Measure, MeasureGroup, Score},
    summary::{GroupScores, TaskScores},
};

/// Number of columns, from the left, that hold text; the others hold numbers.
pub(super) const TEXT_COLUMNS: usize = 2;

/// A table of results, as text cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResultTable {
    /// What the numbers are, above or below the table.
    pub caption: String,
    /// Column headings.
    pub head: Vec<String>,
    /// Rows, each as long as `head`.
    pub rows: Vec<Vec<String>>,
}

pub(super) fn strings<const N: usize>(texts: [&str; N]) -> Vec<String> {
    texts.map(str::to_owned).to_vec()
}

/// Formats a rate with its interval.
pub fn rate(rate: &Rate) -> String {
    let bounds = rate.wilson95.map(|[low, high]| format!(" [{low:.1}, {high:.1}]")).unwrap_or_default();
    rate.rate.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}{bounds}"))
}

/// As [`rate`]; "N/A" for rigid suites and for what was never judged.
fn soft_rate(run: &RunSummary, scores: &GroupScores, of: &Rate) -> String {
    let is_judged = of.rate.is_some() || scores.not_judged == 0;
    if run.is_soft() && is_judged { rate(of) } else { "N/A".to_owned() }
}

/// Number of episodes, and of how many if the run is not finished.
fn episodes(run: &RunSummary) -> String {
    let count = run.run.records.len();
    if run.run.is_partial() {
        format!("{count} of {}", run.run.manifest.requested_episodes())
    } else {
        count.to_string()
    }
}

/// What a safe grip needs in the suites that state it: "A safe grip needs size in: object_varied."
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
pub fn main_table(runs: &[RunSummary]) -> ResultTable {
    let row = |run: &RunSummary| {
        let s = &run.summary.scores;
        vec![
            run.summary.suite.clone(),
            run.method.clone(),
            episodes(run),
            rate(&s.goal_success_rate),
            rate(&s.no_drop_rate),
            soft_rate(run, s, &s.safety_success_rate),
            if run.is_soft() { decimal(s.goal_safe_gap, 1) } else { "N/A".to_owned() },
            s.invalid.to_string(),
            s.dsr.map_or_else(|| "N/A".to_owned(), |dsr| soft_rate(run, s, &dsr)),
            s.not_judged.to_string(),
        ]
    };
    let with_slip: Vec<String> =
        runs.iter().filter(|run| run.summary.no_slip_required).map(RunSummary::name).collect();
    let slip = match with_slip.is_empty() {
        true => String::new(),
        false => format!(" It also requires no slip in the hand in: {}.", with_slip.join("; ")),
    };
    let needs = needs(runs);
    ResultTable {
        caption: format!(
            "Success by suite and method, % of episodes with 95 % Wilson intervals. Safety Success requires the goal, no drop, and a peak deformation within the object's threshold; it does not apply to rigid objects.{slip}{needs} TSR is Goal Success; DSR is Goal Success with the deformation within the threshold, dropped or not."
        ),
        head: strings([
            "Suite",
            "Method",
            "Episodes",
            "Goal Success (TSR)",
            "NoDrop",
            "Safety Success",
            "Gap, pp",
            "Invalid",
            "DSR",
            "Not judged",
        ]),
        rows: runs.iter().map(row).collect(),
    }
}

/// A column with a number of a distribution.
type Statistic = (&'static str, fn(&Distribution) -> Option<f64>);

const MEAN: Statistic = ("mean", |of| of.mean);
const P5: Statistic = ("P5", |of| of.p5);
const MEDIAN: Statistic = ("median", |of| of.median);
const P95: Statistic = ("P95", |of| of.p95);

/// Headings of the columns of measures: one for a rate or a mean, and one per statistic of a distribution.
fn measure_head(scores: &GroupScores, measures: &[&Measure], statistics: &[Statistic]) -> Vec<String> {
    let of = |measure: &&Measure| {
        let mut name = measure.heading.to_owned();
        name[..1].make_ascii_uppercase();
        match (measure.score)(scores) {
            Some(Score::Distribution(_)) => statistics.iter().map(|(of, _)| format!("{name}, {of}")).collect(),
            _ => vec![name],
        }
    };
    measures.iter().flat_map(of).collect()
}

/// Cells of a run below [`measure_head`].
fn measure_cells(run: &RunSummary, measures: &[&Measure], statistics: &[Statistic]) -> Vec<String> {
    let scores = &run.summary.scores;
    let of = |measure: &&Measure| match (measure.score)(scores) {
        Some(Score::Rate(of)) if measure.needs_limit => vec![soft_rate(run, scores, &of)],
        Some(Score::Rate(of)) => vec![of.rate.map_or_else(|| "N/A".to_owned(), |_| rate(&of))],
        Some(Score::Distribution(of)) => statistics.iter().map(|(_, value)| decimal(value(&of), 2)).collect(),
        Some(Score::Mean(mean)) => vec![decimal(mean, 2)],
        None => Vec::new(),
    };
    measures.iter().flat_map(of).collect()
}

/// The measures of a group with the number of episodes of one of them; `None` without a run.
fn group_table(
    runs: &[&RunSummary],
    caption: &str,
    group: MeasureGroup,
    statistics: &[Statistic],
    number: fn(&GroupScores) -> usize,
) -> Option<ResultTable> {
    let measures: Vec<&Measure> = Measure::of(group).collect();
    let row = |run: &&RunSummary| {
        let head = [run.summary.suite.clone(), run.method.clone()];
        let cells = measure_cells(run, &measures, statistics);
        head.into_iter().chain(cells).chain([number(&run.summary.scores).to_string()]).collect()
    };
    let head = measure_head(&runs.first()?.summary.scores, &measures, statistics);
    let head = strings(["Suite", "Method"]).into_iter().chain(head).chain(["Episodes".to_owned()]);
    Some(ResultTable {
        caption: caption.to_owned(),
        head: head.collect(),
        rows: runs.iter().map(row).collect(),
    })
}

fn soft(runs: &[RunSummary]) -> Vec<&RunSummary> {
    runs.iter().filter(|run| run.is_soft()).collect()
}

/// The paper's deformation table; `None` if all suites are rigid.
pub fn deformation_table(runs: &[RunSummary]) -> Option<ResultTable> {
    let within: Vec<&Measure> = MEASURES.iter().filter(|measure| measure.within.is_some()).collect();
    let row = |run: &RunSummary| {
        let peaks = run.summary.scores.deformation;
        let head = [run.summary.suite.clone(), run.method.clone(), decimal(peaks.mean, 2)];
        let percentiles = [peaks.p5, peaks.median, peaks.p95].map(|x| percentile(&peaks, x));
        let counts = [peaks.n.to_string(), peaks.invalid.to_string()];
        head.into_iter().chain(percentiles).chain(counts).chain(measure_cells(run, &within, &[])).collect()
    };
    let head = strings(["Suite", "Method", "Mean", "P5", "Median", "P95", "Valid", "Invalid"]);
    let of_within = soft(runs).first().map(|run| measure_head(&run.summary.scores, &within, &[]));
    soft_table(
        runs,
        "Peak FEM-RMS deformation, % of the settled bounding-box diagonal. The mean is over the valid episodes; percentiles are over all, with invalid ones ranked as worst (∞). On the right, deformation within an episode, averaged over the valid ones; the time over τ in s.",
        head.into_iter().chain(of_within.unwrap_or_default()).collect(),
        row,
    )
}

/// Contact success and the grip ratio; `None` without a run.
pub fn grip_table(runs: &[RunSummary]) -> Option<ResultTable> {
    group_table(
        &runs.iter().collect::<Vec<_>>(),
        "Grip, % of episodes. Contact success is Goal Success with contact of both pads throughout the carry; contact safety is contact success with Safety Success and no slip of more than the limit. The grip ratio is the largest force on a pad over the least that holds the object on its path, over the valid episodes in which it was carried; gentle is Goal Success with a ratio of at most 2, unless the settings state another.",
        MeasureGroup::Grip,
        &[P5, MEDIAN, P95],
        |scores| scores.grip_ratio.n,
    )
}

/// Metrics of the suites; `None` without any.
pub fn metric_table(runs: &[RunSummary]) -> Option<ResultTable> {
    let rows_of = |run: &RunSummary| -> Vec<Vec<String>> {
        let row = |(name, of): (&String, &Distribution)| {
            let numbers = [of.mean, of.p5, of.median, of.p95]
                .map(|value| value.map_or_else(|| "–".to_owned(), |value| significant(value, 4)));
            let head = [run.summary.suite.clone(), format!("{}: {name}", run.method)];
            head.into_iter().chain(numbers).chain([of.n.to_string()]).collect()
        };
        run.summary.scores.metrics.iter().map(row).collect()
    };
    let rows: Vec<Vec<String>> = runs.iter().flat_map(rows_of).collect();
    (!rows.is_empty()).then(|| ResultTable {
        caption: "Metrics of the suites over the valid episodes that have them.".to_owned(),
        head: strings(["Suite", "Method: metric", "Mean", "P5", "Median", "P95", "Episodes"]),
        rows,
    })
}

/// Volume of the target beyond the strain limits of its material; `None` if no material states them.
pub fn crushed_table(runs: &[RunSummary]) -> Option<ResultTable> {
    let is_stated = |run: &RunSummary| {
        run.summary.scores.collapsed_volume.n > 0 || run.summary.scores.damaged_volume.n > 0
    };
    let table = group_table(
        &soft(runs),
        "Volume of the object beyond the strain limits of its material over all valid episodes, %: the largest share beyond the collapse strain at one time, and the share that was ever beyond the damage strain.",
        MeasureGroup::Volume,
        &[MEAN, MEDIAN, P95],
        |scores| scores.collapsed_volume.n,
    );
    table.filter(|_| runs.iter().any(is_stated))
}

/// Safety Success at several κ; `None` if all suites are rigid.
pub fn kappa_table(runs: &[RunSummary]) -> Option<ResultTable> {
    let row = |run: &RunSummary| {
        let known = &run.summary.kappa;
        let at = KAPPAS.map(|kappa| known.iter().find(|row| row.kappa == kappa));
        let cells = at.map(|row| row.map_or_else(|| "–".to_owned(), |row| rate(&row.safety_success_rate)));
        [run.summary.suite.clone(), run.method.clone()].into_iter().chain(cells).collect()
    };
    let heads = KAPPAS.map(|kappa| format!("κ = {kappa}"));
    soft_table(
        runs,
        "Safety Success, % of episodes, where the threshold is κ times D_ref (0.5 is nominal).",
        strings(["Suite", "Method"]).into_iter().chain(heads).collect(),
        row,
    )
}

fn soft_table(
    runs: &[RunSummary],
    caption: &str,
    head: Vec<String>,
    row: impl Fn(&RunSummary) -> Vec<String>,
) -> Option<ResultTable> {
    let rows: Vec<Vec<String>> = runs.iter().filter(|run| run.is_soft()).map(row).collect();
    (!rows.is_empty()).then(|| ResultTable { caption: caption.to_owned(), head, rows })
}

/// Results per task of a run.
pub fn task_table(run: &RunSummary) -> ResultTable {
    let prompt = |task: &TaskScores| format!("{} ({})", task.prompt, task.asset);
    let row = |task: &TaskScores| {
        let s = &task.scores;
        let not_applicable = || "N/A".to_owned();
        let is_soft = run.is_soft();
        vec![
            task.task.to_string(),
            prompt(task),
            s.episodes.to_string(),
            rate(&s.goal_success_rate),
            rate(&s.no_drop_rate),
            soft_rate(run, s, &s.safety_success_rate),
            if is_soft { percentile(&s.deformation, s.deformation.median) } else { not_applicable() },
            if is_soft && s.tau_range.is_some() { tau_range(s.tau_range) } else { not_applicable() },
        ]
    };
    ResultTable {
        caption: format!(
            "{}: per task, with the asset of the object, % of episodes with 95 % Wilson intervals.",
            run.name()
        ),
        head: strings(["Task", "Prompt", "Episodes", "Goal", "NoDrop", "Safety", "D median, %", "τ, %"]),
        rows: run.summary.by_task.iter().map(row).collect(),
    }
}

/// Harm to other objects, and the stages at which episodes failed; `None` without a run.
pub fn stage_table(runs: &[RunSummary]) -> Option<ResultTable> {
    let harm: Vec<&Measure> = Measure::of(MeasureGroup::Harm).collect();
    let row = |run: &RunSummary| {
        let s = &run.summary.scores;
        let head = [run.summary.suite.clone(), run.method.clone(), s.others_unknown.to_string()];
        let harm = measure_cells(run, &harm, &[]);
        let stages =
            TaskStage::ALL.map(|stage| s.failed_stages.get(&stage).copied().unwrap_or(0).to_string());
        head.into_iter().chain(harm).chain(stages).collect()
    };
    let rows: Vec<Vec<String>> = runs.iter().map(row).collect();
    let head = strings(["Suite", "Method", "Others unknown"]);
    let of_harm = measure_head(&runs.first()?.summary.scores, &harm, &[]);
    let stages = TaskStage::ALL.map(|stage| stage.name().to_owned());
    Some(ResultTable {
        caption: "Harm to other objects, % of episodes, with the number of episodes in which harm to others within their τ is unknown; and the number of episodes without Goal Success by the stage at which they ended.".to_owned(),
        head: head.into_iter().chain(of_harm).chain(stages).collect(),
        rows,
    })
}

/// Commands that were not executed as given; `None` without any.
pub fn command_table(runs: &[RunSummary]) -> Option<ResultTable> {
    let row = |run: &RunSummary| {
        let commands = &run.summary.commands;
        vec![
            run.summary.suite.clone(),
            run.method.clone(),
            commands.steps.to_string(),
            commands.far.to_string(),
            commands.far_episodes.to_string(),
            commands.clamped_grips.to_string(),
            commands.clamped_episodes.to_string(),
            commands.clamped_steps.to_string(),
            commands.clamped_step_episodes.to_string(),
            commands.first_far.map_or_else(|| "–".to_owned(), |first| first.to_string()),
        ]
    };
    let is_affected = |run: &&RunSummary| {
        let commands = &run.summary.commands;
        commands.far + commands.clamped_grips + commands.clamped_steps > 0
    };
    let rows: Vec<Vec<String>> = runs.iter().filter(is_affected).map(row).collect();
    (!rows.is_empty()).then(|| ResultTable {
        caption: "Commands that were not executed as given: poses out of reach of one control step, and grip values and displacements out of their range, which are clamped. Many of them mean another unit or frame.".to_owned(),
        head: strings([
            "Suite",
            "Method",
            "Commands",
            "Out of reach",
            "Episodes",
            "Grips out of range",
            "Episodes",
            "Displacements out of range",
            "Episodes",
            "First out of reach",
        ]),
        rows,
    })
}

/// Task-stratified bootstrap intervals of the rates and of the mean D; `None` if no run has enough episodes.
pub fn bootstrap_table(runs: &[RunSummary]) -> Option<ResultTable> {
    let bounds = |bounds: Option<[f64; 2]>, digits: usize| {
        bounds.map_or_else(|| "–".to_owned(), |[low, high]| format!("{low:.digits$} to {high:.digits$}"))
    };
    let row = |run: &RunSummary| {
        let s = &run.summary.scores;
        let dsr = s.dsr.and_then(|dsr| dsr.bootstrap95);
        let rates = [s.tsr.bootstrap95, s.no_drop_rate.bootstrap95, s.safety_success_rate.bootstrap95, dsr];
        let head = [run.summary.suite.clone(), run.method.clone()];
        let rates = rates.map(|rate| bounds(rate, 1));
        head.into_iter().chain(rates).chain([bounds(s.deformation.bootstrap95, 2)]).collect()
    };
    let known = runs.iter().filter(|run| run.summary.scores.tsr.bootstrap95.is_some());
    let rows: Vec<Vec<String>> = known.map(row).collect();
    (!rows.is_empty()).then(|| ResultTable {
        caption: "95 % intervals by the bootstrap within tasks, %: in addition to the Wilson intervals, which take all episodes as independent.".to_owned(),
        head: strings(["Suite", "Method", "TSR", "NoDrop", "Safety Success", "DSR", "D mean"]),
        rows,
    })
}

/// All tables of some runs, in reading order.
pub fn all_tables(runs: &[RunSummary]) -> Vec<ResultTable> {
    let mut all = vec![main_table(runs)];
    all.extend(effects_table(&condition_effects(runs)));
    all.extend(deformation_table(runs));
    all.extend(crushed_table(runs));
    all.extend(grip_table(runs));
    all.extend(metric_table(runs));
    all.extend(kappa_table(runs));
    all.extend(stage_table(runs));
    all.extend(command_table(runs));
    all.extend(bootstrap_table(runs));
    all.extend(runs.iter().map(task_table));
    all
}

/// Longest cell, in characters, that stays on one line in LaTeX.
const MAX_ONE_LINE: usize = 44;

impl ResultTable {
    /// The table as markdown.
    pub fn markdown(&self) -> String {
        let row = |cells: &Vec<String>| format!("| {} |\n", join(cells, escape_markdown, " | "));
        let rule = |i: usize| if i < TEXT_COLUMNS { " --- |" } else { " ---: |" };
        let rule: String = (0..self.head.len()).map(rule).collect();
        let body: String = self.rows.iter().map(row).collect();
        format!("{}\n\n{}|{rule}\n{body}\n", escape_markdown(&self.caption), row(&self.head))
    }

    /// The table as LaTeX with booktabs.
    pub fn latex(&self) -> String {
        let row = |cells: &Vec<String>| format!("    {} \\\\\n", join(cells, escape_latex, " & "));
        let columns: String = (0..self.head.len()).map(|column| self.latex_column(column)).collect();
        let (caption, head) = (escape_latex(&self.caption), row(&self.head));
        let body: String = self.rows.iter().map(row).collect();
        format!(
            "\\begin{{table*}}\n  \\centering\n  \\footnotesize\n  \\caption{{{caption}}}\n  \
             \\begin{{tabular}}{{{columns}}}\n    \\toprule\n{head}    \\midrule\n{body}    \\bottomrule\n  \
             \\end{{tabular}}\n\\end{{table*}}\n"
        )
    }

    /// Column type; columns of long texts wrap.
    fn latex_column(&self, column: usize) -> &'static str {
        let long = self.rows.iter().any(|row| row[column].chars().count() > MAX_ONE_LINE);
        match (column < TEXT_COLUMNS, long) {
            (true, true) => "p{0.28\\textwidth}",
            (true, false) => "l",
            _ => "r",
        }
    }
}

/// Joins escaped cells.
fn join(cells: &[String], escape: fn(&str) -> String, separator: &str) -> String {
    cells.iter().map(|cell| escape(cell)).collect::<Vec<_>>().join(separator)
}

/// Escapes text for markdown.
pub(super) fn escape_markdown(text: &str) -> String {
    let letters: Vec<char> = text.chars().collect();
    let mut out = String::with_capacity(text.len());
    for (i, &c) in letters.iter().enumerate() {
        // Within a word an underscore is not emphasis.
        let is_word =
            |at: Option<usize>| at.and_then(|at| letters.get(at)).is_some_and(|c| c.is_alphanumeric());
        match c {
            '_' if is_word(i.checked_sub(1)) && is_word(Some(i + 1)) => out.push(c),
            '\\' | '|' | '`' | '*' | '_' | '~' | '$' | '#' => out.extend(['\\', c]),
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '&' => out += "&amp;",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    // Brackets around intervals are links only if a parenthesis follows.
    out.replace("](", "]\\(")
}

/// Escapes text for LaTeX.
fn escape_latex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // After the end of a row, a bracket would be read as a length.
    if text.starts_with(['[', '*']) {
        out += "{}";
    }
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out += "\\textbackslash{}",
            '~' => out += "\\textasciitilde{}",
            '^' => out += "\\textasciicircum{}",
            '<' => out += "\\textless{}",
            '>' => out += "\\textgreater{}",
            '|' => out += "\\textbar{}",
            'τ' => out += "$\\tau$",
            'κ' => out += "$\\kappa$",
            'π' => out += "$\\pi$",
            '≤' => out += "$\\leq$",
            '≥' => out += "$\\geq$",
            '→' => out += "$\\rightarrow$",
            '×' => out += "$\\times$",
            '·' => out += "$\\cdot$",
            '−' => out += "$-$",
            '–' => out += "--",
            '…' => out += "\\ldots{}",
            '∞' => out += "$\\infty$",
            c if c.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests;
