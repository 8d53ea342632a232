//! One or several runs as one HTML file that needs no network and no script: tables, figures, failures with their stills,
//! settings.

mod failures;
mod figures;
mod images;
mod settings;

use std::path::Path;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{
    run_summary::RunSummary,
    tables::{Table, deformation_table, kappa_table, main_table, task_table},
};

/// Runs whose details are open from the start.
const OPEN: usize = 4;

/// The page of some runs, to be written into the folder `out`.
pub fn page(runs: &[RunSummary], out: &Path) -> String {
    let episodes: usize = runs.iter().map(|judged| judged.run.records.len()).sum();
    let title = format!("softvt: {}", suites(runs).join(", "));
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
                    p.lead { (counted(episodes, "episode")) " in " (counted(runs.len(), "run")) " · softvt " (env!("CARGO_PKG_VERSION")) }
                    (contents(runs))
                }
                main {
                    (results(runs))
                    (deformation(runs))
                    (section("tasks", "Tasks", &html! { @for judged in runs { (folded(runs, judged, &table(&task_table(judged)))) } }))
                    (section("failures", "Episodes that are not safe", &failures::failures(runs, out)))
                    (section("settings", "Settings", &html! { @for judged in runs { (settings::settings(judged)) } }))
                }
            }
        }
    };
    markup.into_string()
}

/// Names of suites without repetition.
fn suites(runs: &[RunSummary]) -> Vec<String> {
    let mut names: Vec<String> = runs.iter().map(|judged| judged.summary.suite.clone()).collect();
    names.dedup();
    names
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn contents(runs: &[RunSummary]) -> Markup {
    let soft = runs.iter().any(RunSummary::soft);
    html! {
        nav aria-label="Contents" {
            a href="#results" { "Results" }
            @if soft { a href="#deformation" { "Deformation" } }
            a href="#tasks" { "Tasks" }
            a href="#failures" { "Not safe" }
            a href="#settings" { "Settings" }
        }
    }
}

fn section(id: &str, heading: &str, content: &Markup) -> Markup {
    html! { section id=(id) { h2 { (heading) } (content) } }
}

/// Something about one run under its name, which can be folded away.
fn folded(runs: &[RunSummary], judged: &RunSummary, content: &Markup) -> Markup {
    html! { details open[runs.len() <= OPEN] { summary { (judged.name()) } (content) } }
}

fn results(runs: &[RunSummary]) -> Markup {
    let any = |test: fn(&RunSummary) -> bool| runs.iter().any(test);
    let content = html! {
        (table(&main_table(runs)))
        @if any(|judged| judged.summary.privileged) {
            p.note { b { "privileged" } ": the policy sees the true state, which no robot has." }
        }
        @if any(|judged| judged.summary.force_observed) {
            p.note { b { "force_observed" } ": the policy sees the true forces at the pads, which no real sensor gives." }
        }
        @for remark in runs.iter().flat_map(|judged| judged.run.remarks()) { p.warning { (remark) } }
        figure {
            (figures::goal_and_safety(runs))
            figcaption { "What reaches the goal, and what does so safely. The gap between the two is what success alone hides. Whiskers are 95 % Wilson intervals." }
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
            figcaption { "Peak deformation of every valid episode over the threshold τ of its object: right of the line is not safe. Hollow dots missed the goal; bars reach from P5 to P95, the tick is the median." }
        }
        @for judged in runs.iter().filter(|judged| judged.soft() && judged.summary.by_asset.len() > 1) {
            details.extra {
                summary { "By object: " (judged.name()) }
                figure { (figures::by_asset(judged)) }
            }
        }
        h3 { "Strictness of the threshold" }
        (table(&kappas))
        figure {
            (figures::kappa_curves(runs))
            figcaption { "Safety Success as the thresholds are made stricter (left) or looser (right); nominal is κ = 0.5." }
        }
    };
    section("deformation", "Deformation", &content)
}

/// A table that can be scrolled where it is too wide.
fn table(table: &Table) -> Markup {
    let indices = table.rows.iter().all(|row| row[0].chars().all(|c| c.is_ascii_digit()));
    let class = |column: usize| match column {
        0 if indices => "index",
        column if column < table.texts => "text",
        _ => "number",
    };
    html! {
        div.scroll tabindex="0" role="group" aria-label=(table.caption) {
            table {
                caption { span { (table.caption) } }
                thead { tr { @for (i, head) in table.head.iter().enumerate() { th scope="col" class=(class(i)) { (head) } } } }
                tbody {
                    @for row in &table.rows {
                        tr {
                            @for (i, text) in row.iter().enumerate() {
                                @if i == 0 { th scope="row" class=(class(i)) { (text) } }
                                @else { td class=(class(i)) { (cell(text, i < table.texts)) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A cell: the interval of a number stands below it.
fn cell(text: &str, is_text: bool) -> Markup {
    match text.split_once(" [").filter(|_| !is_text) {
        Some((number, interval)) => html! { (number) " " span.interval { "[" (interval) } },
        None => html! { (text) },
    }
}

#[cfg(test)]
mod tests;
