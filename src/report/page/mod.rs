//! HTML report of one or several runs in one file without scripts or external resources: tables, figures, unsafe
//! episodes with stills, and settings.

mod failures;
mod figures;
mod images;

use std::path::Path;

use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::Value;

use softvt_benchmark::run_changes::RunChanges;
use softvt_common::text::{counted, escape_control};

use super::{
    condition_effects::{condition_effects, effects_table},
    run_summary::RunSummary,
    tables::{
        ResultTable, TEXT_COLUMNS, bootstrap_table, command_table, crushed_table, deformation_table,
        kappa_table, main_table, stage_table, task_table,
    },
};

/// Largest number of runs whose details are expanded initially.
const MAX_EXPANDED: usize = 4;

/// The report of some runs, to be written into the folder `out`.
pub fn page(runs: &[RunSummary], out: &Path) -> String {
    let episodes: usize = runs.iter().map(|run| run.run.records.len()).sum();
    let title = format!("softvt: {}", suites(runs).join(", "));
    let lead = format!("{} in {}", counted(episodes, "episode"), counted(runs.len(), "run"));
    let is_soft = runs.iter().any(RunSummary::is_soft);
    let has_conditions = !condition_effects(runs).is_empty();
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                header {
                    h1 { (title) }
                    p.lead { (lead) " · softvt " (env!("CARGO_PKG_VERSION")) }
                    nav aria-label="Contents" {
                        a href="#results" { "Results" }
                        @if has_conditions { a href="#conditions" { "Conditions" } }
                        @if is_soft { a href="#deformation" { "Deformation" } }
                        a href="#tasks" { "Tasks" }
                        a href="#failures" { "Episodes that failed" }
                        a href="#settings" { "Settings" }
                    }
                }
                main { (sections(runs, out)) }
            }
        }
    };
    // Names come from scripts and policies; their control characters must reach neither a terminal nor a clipboard.
    escape_control(&markup.into_string()).into_owned()
}

fn sections(runs: &[RunSummary], out: &Path) -> Markup {
    // Collapsible, one per run.
    let tasks = html! {
        @for (i, run) in runs.iter().enumerate() {
            details open[runs.len() <= MAX_EXPANDED] { summary { (run.name()) } (table(&format!("tasks-{i}"), &task_table(run))) }
        }
    };
    html! {
        (section("results", "Results", &results(runs)))
        @if let Some(conditions) = conditions(runs) { (section("conditions", "Conditions", &conditions)) }
        @if let Some(deformation) = deformation(runs) { (section("deformation", "Deformation", &deformation)) }
        (section("tasks", "Tasks", &tasks))
        (section("failures", "Episodes that failed", &failures::failures(runs, out)))
        (section("settings", "Settings", &html! { @for run in runs { (settings(run)) } }))
    }
}

/// Names of the suites, without repetition.
fn suites(runs: &[RunSummary]) -> Vec<String> {
    let mut names: Vec<String> = runs.iter().map(|run| run.summary.suite.clone()).collect();
    names.dedup();
    names
}

fn section(id: &str, heading: &str, content: &Markup) -> Markup {
    html! { section id=(id) { h2 { (heading) } (content) } }
}

fn results(runs: &[RunSummary]) -> Markup {
    let any = |test: fn(&RunSummary) -> bool| runs.iter().any(test);
    html! {
        (table("results-table", &main_table(runs)))
        @if any(|run| run.summary.privileged) {
            p.note { b { "privileged" } ": the policy has access to ground-truth state, which no robot has." }
        }
        @if any(|run| run.summary.force_observed) {
            p.note { b { "force_observed" } ": the policy observes ground-truth forces at the pads, which no real sensor measures." }
        }
        @for warning in runs.iter().flat_map(|run| run.run.warnings()) { p.warning { (warning) } }
        figure {
            (figures::goal_and_safety(runs))
            figcaption { "Goal Success (TSR) and Safety Success. The gap between them is invisible in success rates alone. Whiskers are 95 % Wilson intervals." }
        }
        @if let Some(bootstrap) = bootstrap_table(runs) { (table("bootstrap-table", &bootstrap)) }
        @if let Some(stages) = stage_table(runs) { (table("stage-table", &stages)) }
        @if let Some(commands) = command_table(runs) { (table("command-table", &commands)) }
    }
}

/// Effects of changed factors; `None` without a run under a condition and its reference.
fn conditions(runs: &[RunSummary]) -> Option<Markup> {
    let effects = condition_effects(runs);
    let effects_table = effects_table(&effects)?;
    Some(html! {
        (table("condition-table", &effects_table))
        @for suite in effects.iter().filter(|suite| !suite.trends().is_empty()) {
            figure {
                (figures::trends(suite))
                figcaption {
                    "Goal and Safety Success, % of the episodes, over the value of each factor: " (suite.suite) ", " (suite.method)
                    ". Values are in the unit of the shift or setting. Whiskers are 95 % Wilson intervals; dashed lines are the reference. Marks are shifted so that both rates are visible."
                }
            }
        }
    })
}

/// `None` if all suites are rigid.
fn deformation(runs: &[RunSummary]) -> Option<Markup> {
    let (deformations, kappas) = (deformation_table(runs)?, kappa_table(runs)?);
    Some(html! {
        (table("deformation-table", &deformations))
        figure {
            (figures::distributions(runs))
            figcaption { "Peak deformation of every valid episode, divided by the threshold τ of its object; episodes right of the line are unsafe. Hollow dots missed the goal. Bars span P5 to P95; the tick is the median." }
        }
        @for run in runs.iter().filter(|run| run.is_soft() && run.summary.by_asset.len() > 1) {
            details.extra {
                summary { "By object: " (run.name()) }
                figure { (figures::by_asset(run)) }
            }
        }
        @if let Some(crushed) = crushed_table(runs) { (table("crushed-table", &crushed)) }
        h3 { "Strictness of the threshold" }
        (table("kappa-table", &kappas))
        figure {
            (figures::kappa_curves(runs))
            figcaption { "Safety Success for stricter (left) and looser (right) thresholds; κ = 0.5 is nominal." }
        }
    })
}

/// A table with its caption. The table scrolls where it is too wide, the caption does not; narrow windows show rows as
/// cards. `id` is unique on the page.
fn table(id: &str, table: &ResultTable) -> Markup {
    let has_index = table.rows.iter().all(|row| row[0].chars().all(|c| c.is_ascii_digit()));
    let class = |column: usize| match column {
        0 if has_index => "index",
        column if column < TEXT_COLUMNS => "text",
        _ => "number",
    };
    let row = |row: &[String]| {
        html! {
            th scope="row" class=(class(0)) data-head=(table.head[0]) { (breakable(&row[0])) }
            @for (i, text) in row.iter().enumerate().skip(1) {
                td class=(class(i)) data-head=(table.head[i]) { (cell(text, i < TEXT_COLUMNS)) }
            }
        }
    };
    html! {
        figure.table {
            div.scroll tabindex="0" role="group" aria-labelledby=(id) {
                table.cards aria-labelledby=(id) {
                    thead { tr { @for (i, head) in table.head.iter().enumerate() { th scope="col" class=(class(i)) { (head) } } } }
                    tbody { @for cells in &table.rows { tr { (row(cells)) } } }
                }
            }
            figcaption id=(id) { (table.caption) }
        }
    }
}

/// A name that may break after underscores.
fn breakable(name: &str) -> Markup {
    html! { @for (i, part) in name.split('_').enumerate() { @if i > 0 { "_" wbr; } (part) } }
}

/// A cell; the interval of a number is shown below it.
fn cell(text: &str, is_text: bool) -> Markup {
    match text.split_once(" [").filter(|_| !is_text) {
        Some((number, interval)) => html! { (number) " " span.interval { "[" (interval) } },
        None if is_text => breakable(text),
        None => html! { (text) },
    }
}

/// The main fields of `run.json`, followed by the whole file.
fn settings(summary: &RunSummary) -> Markup {
    let manifest = &summary.run.manifest;
    let fields = [
        ("Folder", summary.run.dir.display().to_string()),
        ("Script", command_line(&manifest["script"], &manifest["arguments"])),
        ("Policy", summary.summary.method_label()),
        ("softvt", value_text(&manifest["softvt"])),
        ("Seed, split", format!("{}, {}", seed_text(&summary.run.changes()), value_text(&manifest["split"]))),
        ("Episodes", format!("{} of {}", summary.run.records.len(), summary.run.requested_episodes())),
        ("Shifts", pairs(&manifest["shifts"])),
        ("Settings changed", pairs(&manifest["set"])),
        ("Options", entries(&manifest["options"], "")),
        ("Thresholds τ", entries(&manifest["thresholds"], " %")),
    ];
    html! {
        details {
            summary { (summary.name()) }
            dl { @for (name, value) in fields { dt { (name) } dd { @if value.is_empty() { "none" } @else { (value) } } } }
            details.inner { summary { "run.json" } pre { (format!("{manifest:#}")) } }
        }
    }
}

/// The seed of a run. That of a judged run is secret; its hash identifies it.
fn seed_text(RunChanges { seed, seed_hash, .. }: &RunChanges) -> String {
    seed_hash.as_ref().map_or_else(|| seed.to_string(), |hash| format!("secret, SHA-256 {hash}"))
}

fn value_text(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) => number
            .as_f64()
            .filter(|x| x.fract() != 0.0)
            .map_or_else(|| number.to_string(), |x| format!("{:.3}", x).trim_end_matches('0').to_owned()),
        other => other.to_string(),
    }
}

fn command_line(script: &Value, arguments: &Value) -> String {
    let all = [script].into_iter().chain(arguments.as_array().into_iter().flatten());
    all.map(value_text).collect::<Vec<_>>().join(" ")
}

fn pairs(list: &Value) -> String {
    let all = list.as_array().into_iter().flatten();
    all.map(|pair| format!("{}={}", value_text(&pair[0]), value_text(&pair[1])))
        .collect::<Vec<_>>()
        .join(", ")
}

fn entries(object: &Value, unit: &str) -> String {
    let all = object.as_object().into_iter().flatten();
    let shown = |(name, value): (&String, &Value)| match value {
        Value::Null => format!("{name} none"),
        value => format!("{name} {}{unit}", value_text(value)),
    };
    all.map(shown).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests;
