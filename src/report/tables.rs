//! Tables of runs as data; [`super::table_text`] writes them.

use super::judged::Judged;
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
fn soft_rate(judged: &Judged, of: &Rate) -> String {
    if judged.soft() { rate(of) } else { "N/A".to_owned() }
}

/// How many episodes a run has, and of how many if it is not finished.
fn episodes(judged: &Judged) -> String {
    let count = judged.run.records.len();
    if judged.run.is_partial() { format!("{count} of {}", judged.run.wanted()) } else { count.to_string() }
}

/// The paper's main table: Goal and Safety by suite and method.
pub fn main_table(runs: &[Judged]) -> Table {
    let row = |judged: &Judged| {
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
pub fn deformation_table(runs: &[Judged]) -> Option<Table> {
    let numbers = |d: &Distribution| {
        let one = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.2}"));
        [one(d.mean), one(d.p5), one(d.median), one(d.p95), d.n.to_string()]
    };
    let row = |judged: &Judged| {
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
pub fn kappa_table(runs: &[Judged]) -> Option<Table> {
    let row = |judged: &Judged| {
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
    runs: &[Judged],
    caption: &str,
    head: Vec<String>,
    row: impl Fn(&Judged) -> Vec<String>,
) -> Option<Table> {
    let rows: Vec<Vec<String>> = runs.iter().filter(|judged| judged.soft()).map(row).collect();
    (!rows.is_empty()).then(|| Table { caption: caption.to_owned(), head, texts: 2, rows })
}

/// The tasks of a run.
pub fn task_table(judged: &Judged) -> Table {
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
pub fn all_tables(runs: &[Judged]) -> Vec<Table> {
    let mut all = vec![main_table(runs)];
    all.extend(deformation_table(runs));
    all.extend(kappa_table(runs));
    all.extend(runs.iter().map(task_table));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        evaluation::record::tests::sample,
        report::judged::{judge, tests::stored},
    };

    #[test]
    fn rigid_suites_have_no_safety_and_privileged_ones_say_so_in_every_table() {
        let mut rigid = sample();
        rigid.identity.suite = "rigid".into();
        rigid.identity.soft = false;
        (rigid.verdict.d_peak, rigid.verdict.tau, rigid.verdict.deformation_ok) = (None, None, None);
        let runs = judge(vec![stored("a", "expert", vec![sample()]), stored("b", "expert", vec![rigid])]);
        let all = all_tables(&runs);
        assert_eq!(all.len(), 5);
        for table in &all {
            let marked = |text: &String| text.contains("expert (privileged)");
            assert!(
                marked(&table.caption) || table.rows.iter().all(|row| row.iter().any(marked)),
                "{table:?}"
            );
            assert!(table.rows.iter().all(|row| row.len() == table.head.len()));
        }
        let [rigid, soft] = &all[0].rows[..] else { panic!("two rows") };
        assert_eq!((&rigid[5][..], &rigid[6][..]), ("N/A", "N/A"));
        assert_eq!((&soft[5][..], &soft[6][..]), ("100.0 [20.7, 100.0]", "0.0"));
        assert_eq!(
            all[1].rows,
            [strings(["suite", "expert (privileged)", "0.33", "0.33", "0.33", "0.33", "1"])]
        );
    }

    #[test]
    fn a_run_in_progress_shows_how_far_it_is() {
        let mut run = stored("a", "noop", vec![sample()]);
        run.info["episodes"] = serde_json::json!(20);
        let table = main_table(&judge(vec![run]));
        assert_eq!(table.rows[0][2], "1 of 20");
    }
}
