//! One or several runs as one HTML file that needs no other: tables, figures, failures with their films, settings.

mod figures;

use std::{fs, path::Path};

use data_encoding::BASE64;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::tables::{Judged, Table, deformation_table, main_table, reason, task_table};
use crate::evaluation::record::EpisodeRecord;

/// Failed episodes of a run that are listed.
const LISTED: usize = 60;
/// Bytes of films that the page carries; the others are named.
const FILMS: usize = 24 << 20;

/// The page of some runs.
pub fn page(runs: &[Judged]) -> String {
    let mut room = FILMS;
    let suites: Vec<String> = runs.iter().map(|judged| judged.summary.suite.clone()).collect();
    let episodes: usize = runs.iter().map(|judged| judged.run.records.len()).sum();
    let soft = || runs.iter().filter(|judged| !judged.summary.kappa.is_empty());
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "softvt: " (named(&suites)) }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                h1 { "softvt: " (named(&suites)) }
                p.lead { (episodes) " episodes in " (runs.len()) @if runs.len() == 1 { " run" } @else { " runs" } ", softvt " (env!("CARGO_PKG_VERSION")) }
                (table(&main_table(runs)))
                figure {
                    (figures::goal_and_safety(runs))
                    figcaption { "What completes the task and what does so safely; whiskers are 95 % Wilson intervals." }
                }
                @if let Some(deformation) = deformation_table(runs) {
                    h2 { "Deformation" }
                    (table(&deformation))
                    @for judged in soft() {
                        figure {
                            (figures::distributions(judged))
                            figcaption { (judged.summary.suite) ", " (judged.method()) ": peak deformation of every valid episode." }
                        }
                    }
                    figure {
                        (figures::kappa_curves(runs))
                        figcaption { "Safety Success as the thresholds are made stricter (left) or looser (right)." }
                    }
                }
                h2 { "Tasks" }
                @for judged in runs { (table(&task_table(judged))) }
                h2 { "Failures" }
                @for judged in runs { (failures(judged, &mut room)) }
                h2 { "Settings" }
                @for judged in runs {
                    details {
                        summary { (judged.summary.suite) ", " (judged.method()) ": " (judged.run.dir.display()) }
                        pre { (format!("{:#}", judged.run.info)) }
                    }
                }
            }
        }
    };
    markup.into_string()
}

/// Names without repetition.
fn named(names: &[String]) -> String {
    let mut names = names.to_vec();
    names.sort();
    names.dedup();
    names.join(", ")
}

fn table(table: &Table) -> Markup {
    let class = |column: usize| if column < table.texts { "text" } else { "" };
    html! {
        div.scroll {
            table {
                caption { (table.caption) }
                thead { tr { @for (i, head) in table.head.iter().enumerate() { th class=(class(i)) { (head) } } } }
                tbody {
                    @for row in &table.rows {
                        tr { @for (i, cell) in row.iter().enumerate() { td class=(class(i)) { (cell) } } }
                    }
                }
            }
        }
    }
}

/// The episodes of a run that are not safe, with their reasons, and films where there are.
fn failures(judged: &Judged, room: &mut usize) -> Markup {
    let all: Vec<(&EpisodeRecord, String)> =
        judged.run.records.iter().filter_map(|record| Some((record, reason(record)?))).collect();
    let films: Vec<(String, Markup)> = all
        .iter()
        .take(LISTED)
        .filter_map(|(record, reason)| {
            let id = &record.identity;
            let path =
                judged.run.dir.join(format!("video/task_{:03}/episode_{:05}.mp4", id.task, id.episode));
            Some((format!("task {} episode {}: {reason}", id.task, id.episode), film(&path, room)?))
        })
        .collect();
    let rows = all.iter().take(LISTED).map(|(record, reason)| {
        let id = &record.identity;
        vec![id.task.to_string(), id.episode.to_string(), id.asset.clone(), reason.clone()]
    });
    let head = ["Task", "Episode", "Object", "Why"].map(str::to_owned).to_vec();
    let caption = match all.len() {
        0 => format!("{}, {}: none", judged.summary.suite, judged.method()),
        count => format!(
            "{}, {}: {count} of {} episodes are not safe{}",
            judged.summary.suite,
            judged.method(),
            judged.run.records.len(),
            if count > LISTED { format!("; the first {LISTED}") } else { String::new() }
        ),
    };
    html! {
        @if all.is_empty() { p.note { (caption) } }
        @else { (table(&Table { caption, head, texts: 4, rows: rows.collect() })) }
        @if !films.is_empty() {
            div.films { @for (about, film) in &films { article { (film) p { (about) } } } }
        }
    }
}

/// A film in the page, or where it is if the page would become too large; `None` if there is none.
fn film(path: &Path, room: &mut usize) -> Option<Markup> {
    let bytes = fs::read(path).ok()?;
    if bytes.len() > *room {
        return Some(html! { p.note { "film: " (path.display()) } });
    }
    *room -= bytes.len();
    let data = format!("data:video/mp4;base64,{}", BASE64.encode(&bytes));
    Some(html! { video controls muted preload="metadata" src=(data) {} })
}
