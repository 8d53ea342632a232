//! HTML report of one or several runs in one file without scripts or external resources: what the runs show in a
//! sentence, figures, failed episodes with stills, conditions, and folded tables and settings.

mod conditions;
mod deformation_strips;
mod failures;
mod fluid_chart;
mod images;
pub(super) mod kappa_curve;
mod marks;
mod matrix;
mod overview;
mod result_sentences;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    path::Path,
};

use image::RgbImage;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use softvt_common::{
    table::{Heading, Table},
    text::{counted, escape_control},
};
use softvt_runs::{
    manifest::RunManifest,
    run_folder::{RUN, SUMMARY},
};

use super::{
    condition_effects::{ConditionEffects, condition_effects, effects_table},
    report_files::MARKDOWN,
    run_summary::{RunSummary, caveats},
    tables::{
        bootstrap_table, command_table, crushed_table, deformation_table, grip_table, kappa_table,
        main_table, metric_table, stage_table, task_table,
    },
};

/// Small pictures of objects, by asset.
pub type Thumbnails = BTreeMap<String, RgbImage>;

/// The report of some runs, to be written into the folder `out`. Objects without a picture are shown by name only.
pub fn page(runs: &[RunSummary], thumbnails: &Thumbnails, out: &Path) -> String {
    let episodes: usize = runs.iter().map(|run| run.run.records.len()).sum();
    let title = format!("softvt: {}", suites(runs).join(", "));
    let effects = condition_effects(runs);
    let seeds: BTreeSet<String> = runs.iter().map(|run| seed_text(&run.run.manifest)).collect();
    let seeds = seeds.into_iter().collect::<Vec<_>>().join(", ");
    let is_soft = runs.iter().any(RunSummary::is_soft);
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
                    p.lead { (counted(episodes, "episode")) " in " (counted(runs.len(), "run")) " · seed " (seeds) " · softvt " (env!("CARGO_PKG_VERSION")) }
                    (result_sentences::result_sentences(runs, &effects))
                    (result_sentences::chips(runs))
                    @for warning in caveats(runs) { p.warning { (warning) } }
                }
                nav aria-label="Contents" {
                    a href="#results" { "Results" }
                    @if is_soft { a href="#objects" { "Objects" } a href="#episodes" { "Episodes" } }
                    a href="#failures" { "Episodes that failed" }
                    @if !effects.is_empty() { a href="#conditions" { "Conditions" } }
                    a href="#details" { "Details" }
                }
                main { (sections(runs, thumbnails, &effects, is_soft, out)) }
                footer { p.note { "The tables as text: " a href=(MARKDOWN) { (MARKDOWN) } ", report.tex and report.jsonl. docs/results.md defines the quantities." } }
            }
        }
    };
    // Names come from scripts and policies; their control characters must reach neither a terminal nor a clipboard.
    escape_control(&markup.into_string()).into_owned()
}

fn sections(
    runs: &[RunSummary],
    thumbnails: &Thumbnails,
    effects: &[ConditionEffects],
    is_soft: bool,
    out: &Path,
) -> Markup {
    html! {
        (section("results", "Results", &html! { @if !runs.is_empty() { (overview::overview(runs)) } }))
        @if is_soft {
            (section("objects", "Peak deformation by object, as a multiple of its limit", &matrix::matrices(runs, thumbnails, out)))
            (section("episodes", "Every episode", &episodes(runs)))
        }
        (section("failures", "Episodes that failed", &failures::failures(runs, out)))
        @if !effects.is_empty() { (section("conditions", "Conditions", &conditions(effects))) }
        (section("details", "Details", &details(runs, out)))
    }
}

fn episodes(runs: &[RunSummary]) -> Markup {
    html! {
        figure {
            (deformation_strips::deformation_strips(runs))
            figcaption { "Peak deformation D of every valid episode over the limit τ of its object, on a logarithmic axis; right of τ the object is over its limit. The tick is the median; from 10 episodes on a bar spans P5 to P95." }
        }
    }
}

/// Folded: everything that the figures above leave out.
fn details(runs: &[RunSummary], out: &Path) -> Markup {
    let tables = [
        ("Rates with NoDrop and DSR", "rates", Some(main_table(runs))),
        ("Deformation, % of the diagonal", "deformation", deformation_table(runs)),
        ("Volume beyond the strain limits", "volume", crushed_table(runs)),
        ("Grip", "grip", grip_table(runs)),
        ("Metrics of the suite", "metrics", metric_table(runs)),
        ("Harm to other objects, and stages of failures", "stages", stage_table(runs)),
        ("Commands that were not executed as given", "commands", command_table(runs)),
        ("Bootstrap intervals", "bootstrap", bootstrap_table(runs)),
    ];
    html! {
        @for (heading, id, content) in &tables {
            @if let Some(content) = content { details { summary { (heading) } (table(format_args!("{id}-table"), content)) } }
        }
        @if let Some(kappas) = kappa_table(runs) {
            details {
                summary { "Strictness of the limit" }
                (table(format_args!("kappa-table"), &kappas))
                figure {
                    (kappa_curve::kappa_charts(runs))
                    figcaption { "Safety Success for stricter (left) and looser (right) limits τ = κ D_ref; κ = 0.5 is nominal. Bands are 95 % Wilson intervals." }
                }
            }
        }
        details.tasks {
            summary { "Tasks" }
            @for (i, run) in runs.iter().enumerate() {
                details { summary { (run.name()) } (table(format_args!("tasks-{i}"), &task_table(run))) }
            }
        }
        details.settings { summary { "Settings" } @for run in runs { (settings(run, out)) } }
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

/// A heading within a section, with a link to itself. `id` is unique on the page.
fn subheading(id: fmt::Arguments, heading: &str) -> Markup {
    html! { h3 id=(id) { (heading) " " a.anchor href={ "#" (id) } aria-label={ "Link to " (heading) } { "#" } } }
}

fn conditions(effects: &[ConditionEffects]) -> Markup {
    html! {
        @for (i, suite) in effects.iter().enumerate() {
            @if effects.len() > 1 { (subheading(format_args!("suite-{i}"), &suite.name())) }
            @if !suite.trends().is_empty() {
                figure {
                    (conditions::trends(suite))
                    figcaption {
                        "Safety Success with 95 % Wilson intervals, and D/τ of each episode with a line through the medians, over the value of each factor: "
                        (suite.name()) ". The dashed line is the limit; ref. is the unchanged suite, and its dash the median."
                    }
                }
            }
            @if let Some(all) = effects_table(std::slice::from_ref(suite)) {
                (table(format_args!("conditions-{i}"), &without_suite(all, suite)))
            }
        }
    }
}

/// The table of one suite, which its caption names in place of the first column.
fn without_suite(mut table: Table, suite: &ConditionEffects) -> Table {
    table.columns.remove(0);
    table.rows.iter_mut().for_each(|row| drop(row.remove(0)));
    let caption = suite.name() + ": " + &table.caption;
    table.with_caption(caption)
}

/// A table with its caption. The table scrolls where it is too wide, the caption does not; narrow windows show rows as
/// cards. Columns of zeros are left out. `id` is unique on the page.
fn table(id: fmt::Arguments, table: &Table) -> Markup {
    let has_index = table.rows.iter().all(|row| row[0].chars().all(|c| c.is_ascii_digit()));
    let is_empty = |at: usize| table.rows.iter().all(|row| row[at] == "0" || row[at] == "–");
    let shown: Vec<(usize, &Heading, &str)> = (table.columns.iter().enumerate())
        .filter(|(at, column)| !column.is_number || !is_empty(*at))
        .map(|(at, column)| match (at, column.is_number) {
            (0, _) if has_index => (at, column, "index"),
            (_, true) => (at, column, "number"),
            (_, false) => (at, column, "text"),
        })
        .collect();
    html! {
        figure.table {
            div.scroll tabindex="0" role="group" aria-labelledby=(id) {
                table.cards aria-labelledby=(id) {
                    thead { tr { @for (_, column, class) in &shown { th scope="col" class=(class) { (column.text) } } } }
                    tbody {
                        @for row in &table.rows {
                            tr {
                                @for (at, column, class) in &shown {
                                    @if *at == 0 { th scope="row" class=(class) data-head=(column.text) { (breakable(&row[0])) } }
                                    @else { td class=(class) data-head=(column.text) { (cell(&row[*at], !column.is_number)) } }
                                }
                            }
                        }
                    }
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

/// The main fields of `run.json`, and links to the files of the run.
fn settings(summary: &RunSummary, out: &Path) -> Markup {
    let manifest = &summary.run.manifest;
    let RunManifest { script, arguments, shifts, set, options, thresholds, .. } = manifest;
    let command_line: Vec<&str> = [script].into_iter().chain(arguments).map(String::as_str).collect();
    let shifts = shifts.iter().map(|shift| format!("{}={}", shift.name, number(shift.value)));
    let set = set.iter().map(|(path, value)| format!("{path}={value}"));
    let options = options.iter().map(|(name, value)| format!("{name} {value}"));
    let thresholds = thresholds.iter().map(|(asset, tau)| match tau {
        Some(tau) => format!("{asset} {} %", number(*tau)),
        None => format!("{asset} none"),
    });
    let fields = [
        ("Folder", summary.run.dir.display().to_string()),
        ("Script", command_line.join(" ")),
        ("Policy", summary.summary.method_label()),
        ("softvt", manifest.softvt.clone()),
        ("Seed, split", seed_text(manifest) + ", " + manifest.split.name()),
        ("Episodes", format!("{} of {}", summary.run.records.len(), manifest.requested_episodes())),
        ("Shifts", list(shifts)),
        ("Settings changed", list(set)),
        ("Options", list(options)),
        ("Thresholds τ", list(thresholds)),
    ];
    html! {
        details {
            summary { (summary.name()) }
            dl { @for (name, value) in fields { dt { (name) } dd { @if value.is_empty() { "none" } @else { (value) } } } }
            @let links: Vec<(&str, String)> = [RUN, SUMMARY]
                .into_iter()
                .filter_map(|file| Some((file, images::relative_link(out, &summary.run.dir.join(file))?)))
                .collect();
            @if !links.is_empty() { p.note { @for (file, link) in links { a href=(link) { (file) span.hidden { " of " (summary.name()) } } " " } } }
        }
    }
}

/// The seed of a run. That of a judged run is secret; its hash identifies it.
fn seed_text(RunManifest { seed, seed_hash, .. }: &RunManifest) -> String {
    seed_hash.as_ref().map_or_else(|| seed.to_string(), |hash| format!("secret, SHA-256 {hash}"))
}

/// A number with at most three decimals.
fn number(x: f64) -> String {
    match x.fract() {
        0.0 => format!("{x:?}"),
        _ => format!("{x:.3}").trim_end_matches('0').to_owned(),
    }
}

fn list(items: impl Iterator<Item = String>) -> String {
    items.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests;
