//! The differences of two runs as plain text.

use super::{
    cells::{interval, probability, signed},
    comparison::{RunComparison, TaskDifferences},
    styled_text::{Emphasis, StyledText, TerminalFormat},
    task_names::{TaskName, task_names},
};
use softvt_common::{
    table::{Column, Heading, Table},
    text::{counted, decimal, shortened},
};
use softvt_evaluation::stage::TaskStage;
use softvt_runs::{
    measures::{MEASURES, Measure, MeasureGroup},
    paired_stats::{PairedComparison, PairedDifference, PairedStages},
};

/// Width of a policy's name in the header, columns.
const POLICY_WIDTH: usize = 27;

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
pub fn table(comparison: &RunComparison, format: TerminalFormat) -> String {
    let mut text = StyledText::new(format);
    let all = &comparison.all;
    let [first, second] = [&comparison.first, &comparison.second].map(|name| shortened(name, POLICY_WIDTH));
    text.title(format_args!("{first} → {second} · {}", counted(all.pairs, "paired episode")));
    let [first, second] = distinct_headings([0, 1].map(|side| comparison.headings[side].as_str()));
    let mut table = difference_table(&first, &second);
    table.rows.extend(measure_rows(all, comparison.deformable, main_measures()));
    // Of a metric of the suite it is not known whether less is better.
    let metric = |(name, difference): (&String, &PairedDifference)| {
        difference_row(&shortened(name, NAME_WIDTH), difference, 3, Default::default())
    };
    table.rows.extend(all.metrics.iter().map(metric));
    if format.has_details {
        table.rows.extend(measure_rows(all, comparison.deformable, other_measures()));
        table.rows.extend(stage_rows(&all.failed_stages));
    }
    text.plain(table.text());
    text.end();
    push_tasks(&mut text, comparison);
    push_notes(&mut text, comparison);
    text.into_text()
}

/// One line per task in which a rate changed, or per task with details.
fn push_tasks(text: &mut StyledText, comparison: &RunComparison) {
    let tasks = &comparison.by_task;
    let named: Vec<TaskName> = tasks.iter().map(TaskDifferences::name).collect();
    let has_changed = |task: &TaskDifferences| {
        let PairedComparison { goal, no_drop, safety, .. } = task.differences;
        [goal, no_drop, safety].iter().any(|rate| rate.better + rate.worse > 0)
    };
    let shown: Vec<(&TaskDifferences, String)> = (tasks.iter().zip(task_names(&named)))
        .filter(|(task, _)| text.format.has_details || has_changed(task))
        .collect();
    let change = |heading, width, digits: usize, of: fn(&PairedComparison) -> &PairedDifference| {
        let cell = move |(task, _): &(&TaskDifferences, String)| match of(&task.differences) {
            PairedDifference { n: 0, .. } => "N/A".to_owned(),
            of => format!("{} → {}", decimal(of.first, digits), decimal(of.second, digits)),
        };
        Column::number(heading, cell).width(width)
    };
    let name_width = text.width().saturating_sub(57).clamp(14, 40);
    let columns = [
        Column::number("#", |(task, _): &(&TaskDifferences, String)| task.task.to_string()).width(3),
        Column::text("task", |(_, name): &(&TaskDifferences, String)| name.clone()).width(name_width),
        change("Goal, %", 16, 0, |of| &of.goal),
        change("Safety, %", 16, 0, |of| &of.safety),
        change("D/limit", 18, 2, |of| &of.d_over_tau),
    ];
    let mut lines = Table::new(&shown, columns).lines().into_iter();
    let headings = lines.next().filter(|_| !shown.is_empty());
    headings.iter().for_each(|headings| text.plain(headings));
    let mut suite = "";
    for ((task, _), line) in shown.iter().zip(lines) {
        if task.suite != suite && tasks.iter().any(|other| other.suite != task.suite) {
            text.plain(shortened(&task.suite, text.width()));
        }
        suite = &task.suite;
        text.plain(line);
    }
    let hidden = tasks.len() - shown.len();
    if hidden > 0 {
        let hidden = counted(hidden, "task");
        text.line(Emphasis::Faint, format_args!("{hidden} with the same rates; --details shows all"));
    }
    text.end();
}

fn push_notes(text: &mut StyledText, comparison: &RunComparison) {
    text.note(LEGEND);
    text.note("Goal is TSR · D/limit: peak D over τ · N/A: no pair of episodes has it in both runs");
    if text.format.has_details {
        text.note("DSR: goal with D within τ · failed: better where more stages were completed");
    }
    let PairedComparison { goal, no_drop, safety, invalid_pairs, .. } = comparison.all;
    let e_values =
        [("Goal", goal), ("NoDrop", no_drop), ("Safety", safety)].into_iter().filter_map(|(name, rate)| {
            let e = rate.e?;
            Some(if e >= 1e4 { format!("{name} {e:.1e}") } else { format!("{name} {e:.2}") })
        });
    let e_values = e_values.collect::<Vec<_>>().join(", ");
    text.note(format_args!("e-values: {e_values} · 20 is 5 %, also if runs are continued until then"));
    if invalid_pairs > 0 {
        let pairs = counted(invalid_pairs, "pair");
        text.note(format_args!(
            "{pairs} with an invalid episode: failed in success rates; without D, time over τ and volumes"
        ));
    }
    if comparison.unpaired > 0 {
        let verb = if comparison.unpaired == 1 { "was" } else { "were" };
        let episodes = counted(comparison.unpaired, "episode");
        text.note(format_args!("{episodes} present in only one run {verb} skipped"));
    }
    comparison.pairing.iter().chain(&comparison.incomplete).for_each(|sentence| text.note(sentence));
    if !comparison.differing_fields.is_empty() {
        let fields = comparison.differing_fields.join(", ");
        text.note(format_args!("the runs also differ in {fields} (run.json)"));
    }
}

/// Measures of the table without details, by their keys in comparisons.
const MAIN_MEASURES: [&str; 5] = ["goal", "no_drop", "safety", "d_over_tau", "collapsed_volume_pct"];

fn main_measures() -> impl Iterator<Item = &'static Measure> {
    MAIN_MEASURES.iter().filter_map(|key| MEASURES.iter().find(|measure| measure.paired == Some(key)))
}

fn other_measures() -> impl Iterator<Item = &'static Measure> {
    MEASURES.iter().filter(|measure| !MAIN_MEASURES.map(Some).contains(&measure.paired))
}

/// Width of a run's name in the headings, columns.
const HEADING_WIDTH: usize = 8;
const NAME_WIDTH: usize = 18;

/// A table of differences without rows: measure, both values, difference, better, worse, interval and p.
fn difference_table(first: &str, second: &str) -> Table {
    let heading = |(text, width): (&str, usize)| Heading {
        text: text.to_owned(),
        is_number: !text.is_empty(),
        width: Some(width),
    };
    let headings = [
        ("", NAME_WIDTH),
        (first, HEADING_WIDTH),
        (second, HEADING_WIDTH),
        ("diff.", 7),
        ("better", 6),
        ("worse", 5),
        ("95 % interval", 16),
        ("p", 4),
    ];
    Table { columns: headings.map(heading).to_vec(), ..Table::default() }
}

pub(super) fn condition_differences(paired: &PairedComparison, deformable: bool) -> String {
    let mut table = difference_table("ref.", "cond.");
    table.rows.extend(measure_rows(paired, deformable, main_measures().take(4)));
    table.text()
}

/// The rows of measures, without those that rigid targets do not have if none deforms.
fn measure_rows(
    paired: &PairedComparison,
    deformable: bool,
    measures: impl Iterator<Item = &'static Measure>,
) -> impl Iterator<Item = Vec<String>> {
    let is_of_soft = |measure: &Measure| {
        let is_soft_group = matches!(measure.group, MeasureGroup::Deformation | MeasureGroup::Volume);
        is_soft_group || measure.paired == Some("dsr")
    };
    measures.filter(move |measure| deformable || !is_of_soft(measure)).filter_map(|measure| {
        let difference = (measure.difference)(paired)?;
        let counts = [difference.better, difference.worse].map(|count| count.to_string());
        Some(difference_row(&measure.label(), &difference, measure.digits, counts))
    })
}

/// A row with `digits` decimals, or N/A without a pair that has the quantity. One pair has no interval.
fn difference_row(name: &str, paired: &PairedDifference, digits: usize, counts: [String; 2]) -> Vec<String> {
    if paired.n == 0 {
        return [name, "N/A", "N/A"].map(str::to_owned).to_vec();
    }
    let values = [
        name.to_owned(),
        decimal(paired.first, digits),
        decimal(paired.second, digits),
        signed(paired.difference, digits),
    ];
    let interval = interval(paired.interval95.filter(|_| paired.n > 1), digits);
    values.into_iter().chain(counts).chain([interval]).chain(paired.p.map(probability)).collect()
}

/// The number of failed episodes, in total and by stage.
fn stage_rows(stages: &PairedStages) -> Vec<Vec<String>> {
    const FAILED: &str = "failed episodes";
    if stages.n == 0 {
        return vec![[FAILED, "N/A", "N/A"].map(str::to_owned).to_vec()];
    }
    let counts = |name: String, first: usize, second: usize| {
        let difference = second as f64 - first as f64;
        vec![name, first.to_string(), second.to_string(), signed(Some(difference), 0)]
    };
    let [first, second] = [&stages.first, &stages.second];
    let mut total = counts(FAILED.to_owned(), first.values().sum(), second.values().sum());
    total.extend([stages.better.to_string(), stages.worse.to_string()]);
    let of_stage = TaskStage::ALL.into_iter().filter_map(|stage| {
        let [first, second] = [first, second].map(|of| of.get(&stage).copied().unwrap_or(0));
        (first + second > 0).then(|| counts(format!("  {}", stage.name()), first, second))
    });
    std::iter::once(total).chain(of_stage).collect()
}

pub(super) const LEGEND: &str = "diff.: right minus left · better, worse: number of episodes; a lower D is better · 95 % intervals: Agresti and Min for rates, bootstrap for others (n≥10) · p: McNemar's exact test of rates, Wilcoxon's signed-rank test of others";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_of_two_policies_differ_where_their_names_do() {
        let of = |first: &str, second: &str| distinct_headings([first, second]);
        assert_eq!(of("expert", "noop"), ["expert", "noop"]);
        assert_eq!(of("tactile-servo", "expert-binary"), ["tactile…", "expert-…"]);
        assert_eq!(of("policy_of_a", "policy_of_b"), ["…cy_of_a", "…cy_of_b"]);
    }
}
