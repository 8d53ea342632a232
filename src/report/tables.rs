//! Tables of runs, once as data, and as markdown and LaTeX.

use std::fmt::Write;

use super::runs::StoredRun;
use crate::evaluation::{
    record::{EpisodeRecord, Outcome},
    statistics::{Distribution, Rate},
    summary::Summary,
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

/// A run with its results.
#[derive(Clone, Debug)]
pub struct Judged {
    /// What was run.
    pub run: StoredRun,
    /// What came out.
    pub summary: Summary,
}

impl Judged {
    /// Sums a run up.
    pub fn new(run: StoredRun) -> Self {
        let summary = Summary::of(run.text("suite"), run.text("policy"), &run.records);
        Self { run, summary }
    }

    /// The policy, and what of it is beyond what a robot has.
    pub fn method(&self) -> String {
        let privileged = self.run.info["privileged"].as_bool() == Some(true);
        let forces = self.summary.force_observed;
        let marks = [(privileged, "privileged"), (forces, "force_observed")];
        let marks: Vec<&str> = marks.iter().filter(|(is, _)| *is).map(|(_, mark)| *mark).collect();
        let name = &self.summary.policy;
        if marks.is_empty() { name.clone() } else { format!("{name} ({})", marks.join(", ")) }
    }

    fn soft(&self) -> bool {
        self.summary.scores.deformation_ok_rate.is_some()
    }
}

fn strings<const N: usize>(texts: [&str; N]) -> Vec<String> {
    texts.map(str::to_owned).to_vec()
}

/// A rate with its interval.
pub fn rate(rate: &Rate) -> String {
    let bounds = rate.wilson95.map(|[low, high]| format!(" [{low:.1}, {high:.1}]")).unwrap_or_default();
    rate.rate.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}{bounds}"))
}

/// The paper's main table: Goal and Safety by suite and method.
pub fn main_table(runs: &[Judged]) -> Table {
    let row = |judged: &Judged| {
        let s = &judged.summary.scores;
        let (safety, gap) = match judged.soft() {
            true => (
                rate(&s.safety_success_rate),
                s.goal_safe_gap.map_or_else(|| "–".to_owned(), |g| format!("{g:.1}")),
            ),
            false => strings(["N/A", "N/A"]).try_into().map(|[a, b]: [String; 2]| (a, b)).unwrap_or_default(),
        };
        vec![
            judged.summary.suite.clone(),
            judged.method(),
            s.episodes.to_string(),
            rate(&s.goal_success_rate),
            rate(&s.no_drop_rate),
            safety,
            gap,
            s.invalid.to_string(),
        ]
    };
    Table {
        caption: "Success by suite and method, % of episodes with 95 % Wilson intervals; Safety asks for the goal, no drop and a peak deformation within the object's threshold".to_owned(),
        head: strings(["Suite", "Method", "Episodes", "Goal Success", "NoDrop", "Safety Success", "Gap, points", "Invalid"]),
        texts: 2,
        rows: runs.iter().map(row).collect(),
    }
}

/// The paper's deformation table; `None` if nothing deforms.
pub fn deformation_table(runs: &[Judged]) -> Option<Table> {
    let numbers = |d: &Distribution| {
        let one = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.2}"));
        [one(d.mean), one(d.p5), one(d.median), one(d.p95), d.n.to_string()]
    };
    let row = |judged: &Judged| {
        let head = [judged.summary.suite.clone(), judged.method()];
        head.into_iter().chain(numbers(&judged.summary.scores.deformation)).collect()
    };
    let rows: Vec<Vec<String>> = runs.iter().filter(|judged| judged.soft()).map(row).collect();
    (!rows.is_empty()).then(|| Table {
        caption: "Peak FEM-RMS deformation over all valid episodes, % of the settled bounding-box diagonal"
            .to_owned(),
        head: strings(["Suite", "Method", "Mean", "P5", "Median", "P95", "Episodes"]),
        texts: 2,
        rows,
    })
}

/// The tasks of a run.
pub fn task_table(judged: &Judged) -> Table {
    let row = |task: &crate::evaluation::summary::TaskScores| {
        let s = &task.scores;
        let tau = judged.summary.by_asset.get(&task.asset).and_then(|asset| asset.tau);
        let number = |x: Option<f64>| x.map_or_else(|| "N/A".to_owned(), |x| format!("{x:.2}"));
        vec![
            task.task.to_string(),
            task.prompt.clone(),
            rate(&s.goal_success_rate),
            rate(&s.no_drop_rate),
            if judged.soft() { rate(&s.safety_success_rate) } else { "N/A".to_owned() },
            number(s.deformation.median),
            number(tau),
        ]
    };
    Table {
        caption: format!("{}, {}: by task", judged.summary.suite, judged.method()),
        head: strings(["#", "Task", "Goal", "NoDrop", "Safety", "D median, %", "τ, %"]),
        texts: 2,
        rows: judged.summary.by_task.iter().map(row).collect(),
    }
}

/// Why an episode is not safe; `None` if it is.
pub fn reason(record: &EpisodeRecord) -> Option<String> {
    let v = &record.verdict;
    if v.safety {
        return None;
    }
    let mut parts = Vec::new();
    match &record.outcome {
        Outcome::Invalid { reason, step, .. } => {
            parts.push(format!("invalid: {reason} at physics step {step}"))
        }
        Outcome::Error { message } => parts.push(message.clone()),
        Outcome::Timeout if !v.goal => parts.push("the budget ran out".to_owned()),
        Outcome::Timeout | Outcome::Completed => {}
    }
    if let Some(drop) = &v.drop {
        let what =
            serde_json::to_value(drop.reason).ok().and_then(|v| v.as_str().map(|s| s.replace('_', " ")));
        parts.push(format!("dropped at {:.1} s: {}", drop.time_s, what.unwrap_or_default()));
    }
    if v.wrong_instance {
        parts.push("another object was lifted first".to_owned());
    }
    match (v.d_peak, v.tau) {
        (Some(d), Some(tau)) if d > tau => parts.push(format!("D {d:.2} % is above τ {tau:.2} %")),
        (_, None) if record.identity.soft => parts.push("the object has no threshold".to_owned()),
        _ => {}
    }
    if parts.is_empty() && !v.safety_known {
        parts.push("evidence is missing".to_owned());
    }
    Some(parts.join("; "))
}

impl Table {
    /// As a table of markdown.
    pub fn markdown(&self) -> String {
        let cell = |text: &String| text.replace('|', "\\|").replace('\n', " ");
        let row =
            |cells: &[String]| format!("| {} |\n", cells.iter().map(cell).collect::<Vec<_>>().join(" | "));
        let rule: Vec<String> =
            (0..self.head.len()).map(|i| if i < self.texts { "---" } else { "---:" }.to_owned()).collect();
        let body: String = self.rows.iter().map(|cells| row(cells)).collect();
        format!("{}\n\n{}{}{body}\n", self.caption, row(&self.head), row(&rule))
    }

    /// As a table of LaTeX with booktabs.
    pub fn latex(&self) -> String {
        let columns: String = (0..self.head.len()).map(|i| if i < self.texts { 'l' } else { 'r' }).collect();
        let row = |cells: &[String]| {
            format!("    {} \\\\\n", cells.iter().map(|c| latex(c)).collect::<Vec<_>>().join(" & "))
        };
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(out, "\\begin{{table}}\n  \\centering\n  \\caption{{{}}}", latex(&self.caption));
        let _ = writeln!(out, "  \\begin{{tabular}}{{{columns}}}\n    \\toprule");
        out += &row(&self.head);
        out += "    \\midrule\n";
        out.extend(self.rows.iter().map(|cells| row(cells)));
        out += "    \\bottomrule\n  \\end{tabular}\n\\end{table}\n";
        out
    }
}

/// Text for LaTeX.
fn latex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out += "\\textbackslash{}",
            '~' => out += "\\textasciitilde{}",
            '^' => out += "\\textasciicircum{}",
            'τ' => out += "$\\tau$",
            'κ' => out += "$\\kappa$",
            '–' => out += "--",
            '\n' => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::record::tests::sample;

    #[test]
    fn cells_cannot_break_out_of_their_tables() {
        let table = Table {
            caption: "50 %".into(),
            head: strings(["a_b", "n"]),
            texts: 1,
            rows: vec![strings(["x|y & \\z", "1"])],
        };
        assert!(table.markdown().contains("| x\\|y & \\z | 1 |\n"));
        let latex = table.latex();
        assert!(
            latex.contains("a\\_b & n \\\\") && latex.contains("x|y \\& \\textbackslash{}z & 1 \\\\"),
            "{latex}"
        );
        assert!(latex.contains("\\caption{50 \\%}"));
    }

    #[test]
    fn an_unsafe_episode_says_why() {
        let mut record = sample();
        assert_eq!(reason(&record), None);
        record.verdict.safety = false;
        record.verdict.d_peak = Some(2.5);
        assert_eq!(reason(&record).unwrap(), "D 2.50 % is above τ 1.00 %");
        record.verdict.goal = false;
        record.outcome = Outcome::Timeout;
        assert_eq!(reason(&record).unwrap(), "the budget ran out; D 2.50 % is above τ 1.00 %");
        record.outcome = Outcome::Error { message: "the action holds NaN".into() };
        assert!(reason(&record).unwrap().starts_with("the action holds NaN"));
    }
}
