//! Tables of runs as data; [`super::table_text`] writes them.

use std::fmt::Write;

use super::run_summary::RunSummary;
use crate::evaluation::{
    safety::KAPPAS,
    statistics::{Distribution, Rate},
    summary::TaskScores,
};

/// A table: text cells under a head.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Heads of the columns.
    pub head: Vec<String>,
    /// Columns from the left that are text; the others are numbers.
    pub texts: usize,
    /// Its rows, each as long as the head.
    pub rows: Vec<Vec<String>>,
}

pub(super) fn strings<const N: usize>(texts: [&str; N]) -> Vec<String> {
    texts.map(str::to_owned).to_vec()
}

/// A rate with its interval.
pub fn rate(rate: &Rate) -> String {
    let bounds = rate.wilson95.map(|[low, high]| format!(" [{low:.1}, {high:.1}]")).unwrap_or_default();
    rate.rate.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}{bounds}"))
}

/// The same where something deforms.
fn soft_rate(judged: &RunSummary, of: &Rate) -> String {
    if judged.soft() { rate(of) } else { "N/A".to_owned() }
}

/// How many episodes a run has, and of how many if it is not finished.
fn episodes(judged: &RunSummary) -> String {
    let count = judged.run.records.len();
    if judged.run.is_partial() { format!("{count} of {}", judged.run.wanted()) } else { count.to_string() }
}

/// The paper's main table: Goal and Safety by suite and method.
pub fn main_table(runs: &[RunSummary]) -> Table {
    let row = |judged: &RunSummary| {
        let s = &judged.summary.scores;
        let gap = s.goal_safe_gap.map_or_else(|| "–".to_owned(), |gap| format!("{gap:.1}"));
        vec![
            judged.summary.suite.clone(),
            judged.method.clone(),
            episodes(judged),
            rate(&s.goal_success_rate),
            rate(&s.no_drop_rate),
            soft_rate(judged, &s.safety_success_rate),
            if judged.soft() { gap } else { "N/A".to_owned() },
            s.invalid.to_string(),
        ]
    };
    Table {
        caption: "Success by suite and method, % of episodes with 95 % Wilson intervals. Safety Success asks for the goal, no drop, and a peak deformation within the object's threshold; it does not apply to rigid objects.".to_owned(),
        head: strings(["Suite", "Method", "Episodes", "Goal Success", "NoDrop", "Safety Success", "Gap, points", "Invalid"]),
        texts: 2,
        rows: runs.iter().map(row).collect(),
    }
}

/// The paper's deformation table; `None` if nothing deforms.
pub fn deformation_table(runs: &[RunSummary]) -> Option<Table> {
    let numbers = |d: &Distribution| {
        let one = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.2}"));
        [one(d.mean), one(d.p5), one(d.median), one(d.p95), d.n.to_string()]
    };
    let row = |judged: &RunSummary| {
        let head = [judged.summary.suite.clone(), judged.method.clone()];
        head.into_iter().chain(numbers(&judged.summary.scores.deformation)).collect()
    };
    soft_table(
        runs,
        "Peak FEM-RMS deformation over all valid episodes, % of the settled bounding-box diagonal.",
        strings(["Suite", "Method", "Mean", "P5", "Median", "P95", "Episodes"]),
        row,
    )
}

/// Safety at the κ of the sensitivity table; `None` if nothing deforms.
pub fn kappa_table(runs: &[RunSummary]) -> Option<Table> {
    let row = |judged: &RunSummary| {
        let known = &judged.summary.kappa;
        let at = KAPPAS.map(|kappa| known.iter().find(|row| row.kappa == kappa));
        let cells = at.map(|row| row.map_or_else(|| "–".to_owned(), |row| rate(&row.safety_success_rate)));
        [judged.summary.suite.clone(), judged.method.clone()].into_iter().chain(cells).collect()
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
) -> Option<Table> {
    let rows: Vec<Vec<String>> = runs.iter().filter(|judged| judged.soft()).map(row).collect();
    (!rows.is_empty()).then(|| Table { caption: caption.to_owned(), head, texts: 2, rows })
}

/// The tasks of a run.
pub fn task_table(judged: &RunSummary) -> Table {
    let row = |task: &TaskScores| {
        let s = &task.scores;
        let tau = judged.summary.by_asset.get(&task.asset).and_then(|asset| asset.tau);
        let absent = if judged.soft() { "–" } else { "N/A" };
        let number = |x: Option<f64>| x.map_or_else(|| absent.to_owned(), |x| format!("{x:.2}"));
        vec![
            task.task.to_string(),
            task.prompt.clone(),
            s.episodes.to_string(),
            rate(&s.goal_success_rate),
            rate(&s.no_drop_rate),
            soft_rate(judged, &s.safety_success_rate),
            number(s.deformation.median),
            number(tau),
        ]
    };
    Table {
        caption: format!("{}: by task, % of episodes with 95 % Wilson intervals.", judged.name()),
        head: strings(["Task", "Prompt", "Episodes", "Goal", "NoDrop", "Safety", "D median, %", "τ, %"]),
        texts: 2,
        rows: judged.summary.by_task.iter().map(row).collect(),
    }
}

/// All tables of some runs, in the order in which one reads them.
pub fn all_tables(runs: &[RunSummary]) -> Vec<Table> {
    let mut all = vec![main_table(runs)];
    all.extend(deformation_table(runs));
    all.extend(kappa_table(runs));
    all.extend(runs.iter().map(task_table));
    all
}

/// Letters of the longest cell that stays on one line in LaTeX.
const ONE_LINE: usize = 44;

impl Table {
    /// As a table of markdown.
    pub fn markdown(&self) -> String {
        let row = |cells: &[String]| {
            format!("| {} |\n", cells.iter().map(|cell| markdown(cell)).collect::<Vec<_>>().join(" | "))
        };
        let rule: Vec<&str> =
            (0..self.head.len()).map(|i| if i < self.texts { "---" } else { "---:" }).collect();
        let body: String = self.rows.iter().map(|cells| row(cells)).collect();
        format!("{}\n\n{}| {} |\n{body}\n", markdown(&self.caption), row(&self.head), rule.join(" | "))
    }

    /// As a table of LaTeX with booktabs.
    pub fn latex(&self) -> String {
        let row = |cells: &[String]| {
            format!("    {} \\\\\n", cells.iter().map(|cell| latex(cell)).collect::<Vec<_>>().join(" & "))
        };
        let columns: String = (0..self.head.len()).map(|column| self.latex_column(column)).collect();
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "\\begin{{table*}}\n  \\centering\n  \\footnotesize\n  \\caption{{{}}}",
            latex(&self.caption)
        );
        let _ = writeln!(out, "  \\begin{{tabular}}{{{columns}}}\n    \\toprule");
        out += &row(&self.head);
        out += "    \\midrule\n";
        out.extend(self.rows.iter().map(|cells| row(cells)));
        out += "    \\bottomrule\n  \\end{tabular}\n\\end{table*}\n";
        out
    }

    /// Long texts are broken into lines.
    fn latex_column(&self, column: usize) -> &'static str {
        let long = self.rows.iter().any(|row| row[column].chars().count() > ONE_LINE);
        match (column < self.texts, long) {
            (true, true) => "p{0.28\\textwidth}",
            (true, false) => "l",
            _ => "r",
        }
    }
}

/// Text for markdown.
fn markdown(text: &str) -> String {
    let letters: Vec<char> = text.chars().collect();
    let mut out = String::with_capacity(text.len());
    for (i, &c) in letters.iter().enumerate() {
        // Inside of a word an underscore is no emphasis.
        let beside =
            |at: Option<usize>| at.and_then(|at| letters.get(at)).is_some_and(|c| c.is_alphanumeric());
        match c {
            '_' if beside(i.checked_sub(1)) && beside(Some(i + 1)) => out.push(c),
            '\\' | '|' | '`' | '*' | '_' | '~' | '$' | '#' => out.extend(['\\', c]),
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '&' => out += "&amp;",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    // Brackets are those of intervals; only with an address behind them would they be a link.
    out.replace("](", "]\\(")
}

/// Text for LaTeX.
fn latex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // Behind the end of a row a bracket would be a length.
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
