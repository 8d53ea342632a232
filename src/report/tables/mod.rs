//! Result tables of runs, as markdown and as LaTeX with booktabs. Names come from scripts and are escaped.

use super::run_summary::RunSummary;
use softvt_common::text::decimal;
use softvt_evaluation::{
    safety::KAPPAS,
    statistics::{Distribution, Rate},
    summary::TaskScores,
};

/// Number of columns, from the left, that hold text; the others hold numbers.
pub(super) const TEXT_COLUMNS: usize = 2;

/// A table of results, as text cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResultTable {
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

/// As [`rate`]; "N/A" for rigid suites.
fn soft_rate(run: &RunSummary, of: &Rate) -> String {
    if run.is_soft() { rate(of) } else { "N/A".to_owned() }
}

/// Number of episodes, and of how many if the run is not finished.
fn episodes(run: &RunSummary) -> String {
    let count = run.run.records.len();
    if run.run.is_partial() {
        format!("{count} of {}", run.run.requested_episodes())
    } else {
        count.to_string()
    }
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
            soft_rate(run, &s.safety_success_rate),
            if run.is_soft() { decimal(s.goal_safe_gap, 1) } else { "N/A".to_owned() },
            s.invalid.to_string(),
        ]
    };
    ResultTable {
        caption: "Success by suite and method, % of episodes with 95 % Wilson intervals. Safety Success requires the goal, no drop, and a peak deformation within the object's threshold; it does not apply to rigid objects.".to_owned(),
        head: strings(["Suite", "Method", "Episodes", "Goal Success", "NoDrop", "Safety Success", "Gap, pp", "Invalid"]),
        rows: runs.iter().map(row).collect(),
    }
}

/// The paper's deformation table; `None` if all suites are rigid.
pub fn deformation_table(runs: &[RunSummary]) -> Option<ResultTable> {
    let row = |run: &RunSummary| {
        let Distribution { mean, p5, median, p95, n } = run.summary.scores.deformation;
        let head = [run.summary.suite.clone(), run.method.clone()];
        let figures = [mean, p5, median, p95].map(|x| decimal(x, 2));
        head.into_iter().chain(figures).chain([n.to_string()]).collect()
    };
    soft_table(
        runs,
        "Peak FEM-RMS deformation over all valid episodes, % of the settled bounding-box diagonal.",
        strings(["Suite", "Method", "Mean", "P5", "Median", "P95", "Episodes"]),
        row,
    )
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
        "Safety Success, % of episodes, where the threshold is κ times the largest stable deformation (0.5 is nominal).",
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
    let row = |task: &TaskScores| {
        let s = &task.scores;
        let tau = run.summary.by_asset.get(&task.asset).and_then(|asset| asset.tau);
        let number = |x: Option<f64>| match x {
            None if !run.is_soft() => "N/A".to_owned(),
            x => decimal(x, 2),
        };
        vec![
            task.task.to_string(),
            task.prompt.clone(),
            s.episodes.to_string(),
            rate(&s.goal_success_rate),
            rate(&s.no_drop_rate),
            soft_rate(run, &s.safety_success_rate),
            number(s.deformation.median),
            number(tau),
        ]
    };
    ResultTable {
        caption: format!("{}: per task, % of episodes with 95 % Wilson intervals.", run.name()),
        head: strings(["Task", "Prompt", "Episodes", "Goal", "NoDrop", "Safety", "D median, %", "τ, %"]),
        rows: run.summary.by_task.iter().map(row).collect(),
    }
}

/// All tables of some runs, in reading order.
pub fn all_tables(runs: &[RunSummary]) -> Vec<ResultTable> {
    let mut all = vec![main_table(runs)];
    all.extend(deformation_table(runs));
    all.extend(kappa_table(runs));
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
fn escape_markdown(text: &str) -> String {
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
            '–' => out += "--",
            '…' => out += "\\ldots{}",
            c if c.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests;
