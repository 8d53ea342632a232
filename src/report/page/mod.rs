//! HTML report of one or several runs in one file without scripts or external resources: tables, figures, unsafe
//! episodes with stills, and settings.

mod failures;
mod figures;
mod images;
mod settings;

use std::path::Path;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::text::counted;

use super::{
    run_summary::RunSummary,
    tables::{ResultTable, TEXT_COLUMNS, deformation_table, kappa_table, main_table, task_table},
};

/// Largest number of runs whose details are expanded initially.
const MAX_EXPANDED: usize = 4;

/// The report of some runs, to be written into the folder `out`.
pub fn page(runs: &[RunSummary], out: &Path) -> String {
    let episodes: usize = runs.iter().map(|run| run.run.records.len()).sum();
    let title = format!("softvt: {}", suites(runs).join(", "));
    let lead = format!("{} in {}", counted(episodes, "episode"), counted(runs.len(), "run"));
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&title))
            body {
                header {
                    h1 { (title) }
                    p.lead { (lead) " · softvt " (env!("CARGO_PKG_VERSION")) }
                    (contents(runs))
                }
                main { (sections(runs, out)) }
            }
        }
    };
    markup.into_string()
}

fn head(title: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta name="color-scheme" content="light dark";
            title { (title) }
            style { (PreEscaped(include_str!("page.css"))) }
        }
    }
}

fn sections(runs: &[RunSummary], out: &Path) -> Markup {
    let tasks = html! { @for run in runs { (collapsible(runs, run, &table(&task_table(run)))) } };
    let settings = html! { @for run in runs { (settings::settings(run)) } };
    html! {
        (results(runs))
        (deformation(runs))
        (section("tasks", "Tasks", &tasks))
        (section("failures", "Unsafe episodes", &failures::failures(runs, out)))
        (section("settings", "Settings", &settings))
    }
}

/// Names of the suites, without repetition.
fn suites(runs: &[RunSummary]) -> Vec<String> {
    let mut names: Vec<String> = runs.iter().map(|run| run.summary.suite.clone()).collect();
    names.dedup();
    names
}

fn contents(runs: &[RunSummary]) -> Markup {
    let soft = runs.iter().any(RunSummary::is_soft);
    html! {
        nav aria-label="Contents" {
            a href="#results" { "Results" }
            @if soft { a href="#deformation" { "Deformation" } }
            a href="#tasks" { "Tasks" }
            a href="#failures" { "Unsafe episodes" }
            a href="#settings" { "Settings" }
        }
    }
}

fn section(id: &str, heading: &str, content: &Markup) -> Markup {
    html! { section id=(id) { h2 { (heading) } (content) } }
}

/// Content about one run under its name, collapsible.
fn collapsible(runs: &[RunSummary], run: &RunSummary, content: &Markup) -> Markup {
    html! { details open[runs.len() <= MAX_EXPANDED] { summary { (run.name()) } (content) } }
}

fn results(runs: &[RunSummary]) -> Markup {
    let any = |test: fn(&RunSummary) -> bool| runs.iter().any(test);
    let content = html! {
        (table(&main_table(runs)))
        @if any(|run| run.summary.privileged) {
            p.note { b { "privileged" } ": the policy has access to ground-truth state, which no robot has." }
        }
        @if any(|run| run.summary.force_observed) {
            p.note { b { "force_observed" } ": the policy observes ground-truth forces at the pads, which no real sensor measures." }
        }
        @for warning in runs.iter().flat_map(|run| run.run.warnings()) { p.warning { (warning) } }
        figure {
            (figures::goal_and_safety(runs))
            figcaption { "Goal Success and Safety Success. The gap between them is invisible in success rates alone. Whiskers are 95 % Wilson intervals." }
        }
    };
    section("results", "Results", &content)
}

fn deformation(runs: &[RunSummary]) -> Markup {
    let (Some(deformations), Some(kappas)) = (deformation_table(runs), kappa_table(runs)) else {
        return html! {};
    };
    let content = html! {
        (table(&deformations))
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
        h3 { "Strictness of the threshold" }
        (table(&kappas))
        figure {
            (figures::kappa_curves(runs))
            figcaption { "Safety Success for stricter (left) and looser (right) thresholds; κ = 0.5 is nominal." }
        }
    };
    section("deformation", "Deformation", &content)
}

/// A table that scrolls horizontally where it is too wide.
fn table(table: &ResultTable) -> Markup {
    let has_index = table.rows.iter().all(|row| row[0].chars().all(|c| c.is_ascii_digit()));
    let class = |column: usize| match column {
        0 if has_index => "index",
        column if column < TEXT_COLUMNS => "text",
        _ => "number",
    };
    let head = html! {
        @for (i, head) in table.head.iter().enumerate() { th scope="col" class=(class(i)) { (head) } }
    };
    let row = |row: &[String]| {
        html! {
            th scope="row" class=(class(0)) { (row[0]) }
            @for (i, text) in row.iter().enumerate().skip(1) {
                td class=(class(i)) { (cell(text, i < TEXT_COLUMNS)) }
            }
        }
    };
    html! {
        div.scroll tabindex="0" role="group" aria-label=(table.caption) {
            table {
                caption { span { (table.caption) } }
                thead { tr { (head) } }
                tbody { @for cells in &table.rows { tr { (row(cells)) } } }
            }
        }
    }
}

/// A cell; the interval of a number is shown below it.
fn cell(text: &str, is_text: bool) -> Markup {
    match text.split_once(" [").filter(|_| !is_text) {
        Some((number, interval)) => html! { (number) " " span.interval { "[" (interval) } },
        None => html! { (text) },
    }
}

#[cfg(test)]
mod tests;
