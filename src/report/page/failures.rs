//! The episodes that are not safe: why, and how they looked or how to see them.

use std::path::Path;

use maud::{Markup, html};
use serde_json::Value;

use super::images::{Room, embedded, link};
use crate::{
    evaluation::record::{EpisodeRecord, Identity},
    report::{
        run_summary::RunSummary,
        video::{still_path, video_path},
    },
};

/// Episodes of a run that are listed.
const LISTED: usize = 60;
/// Bytes of stills that a page carries.
const STILLS: usize = 12 << 20;

/// The episodes of all runs that are not safe, for a page in the folder `out`.
pub(super) fn failures(runs: &[RunSummary], out: &Path) -> Markup {
    // Each run gets its share, so that those of the first do not take it all.
    let share = STILLS / runs.len().max(1);
    html! { @for judged in runs { (of_run(judged, out, share)) } }
}

fn of_run(judged: &RunSummary, out: &Path, share: usize) -> Markup {
    let all = judged.unsafe_episodes();
    let count = judged.run.records.len();
    let mut room = Room(share);
    let stills: Vec<Markup> = all
        .iter()
        .take(LISTED)
        .filter_map(|(record, why)| still(judged, record, why, out, &mut room))
        .collect();
    html! {
        h3 { (judged.name()) }
        @if all.is_empty() {
            p.note { @if count == 0 { "There is no episode yet." } @else { "All " (count) " episodes are safe." } }
        } @else {
            p.note {
                (all.len()) " of " (count) " episodes"
                @if all.len() > LISTED { "; the first " (LISTED) " are listed" }
                "."
            }
            @if !stills.is_empty() { div.stills { @for still in &stills { (still) } } }
            div.scroll tabindex="0" role="group" aria-label=(format!("Episodes of {} that are not safe", judged.name())) {
                table.failures {
                    thead { tr {
                        th.number scope="col" { "Task" } th.number scope="col" { "Episode" }
                        th.text scope="col" { "Object" } th.text scope="col" { "Why, and how to see it" }
                    } }
                    tbody { @for (record, why) in all.iter().take(LISTED) { (row(judged, record, why, out)) } }
                }
            }
        }
    }
}

fn row(judged: &RunSummary, record: &EpisodeRecord, why: &str, out: &Path) -> Markup {
    let id = &record.identity;
    let video = link(out, &video_path(&judged.run.dir, id.task, id.episode));
    html! {
        tr {
            th.number scope="row" { (id.task) }
            td.number { (id.episode) }
            td.text { (id.asset) }
            td.text {
                (unbroken(why))
                @if let Some(video) = video { br; a href=(video) { "video" } }
                @else { @for command in commands(judged, id) { br; code { (command) } } }
            }
        }
    }
}

/// The worst moment of an episode, if it was drawn.
fn still(
    judged: &RunSummary,
    record: &EpisodeRecord,
    why: &str,
    out: &Path,
    room: &mut Room,
) -> Option<Markup> {
    let id = &record.identity;
    let place = format!("Task {} episode {}", id.task, id.episode);
    let (address, [width, height]) = embedded(&still_path(&judged.run.dir, id.task, id.episode), room)?;
    let alt = format!(
        "{place}, {}, at its worst moment: third-person and wrist camera above, left and right finger below, deformation at the bottom",
        id.asset
    );
    let picture = html! { img src=(address) width=(width) height=(height) alt=(alt) loading="lazy"; };
    let video = link(out, &video_path(&judged.run.dir, id.task, id.episode));
    Some(html! {
        figure.still {
            @match video {
                Some(video) => a href=(video) { (picture) },
                None => (picture),
            }
            figcaption { b { (place) } ": " (unbroken(why)) }
        }
    })
}

/// A sentence in which no unit is parted from its number.
fn unbroken(text: &str) -> String {
    text.replace(" %", "\u{a0}%").replace("τ ", "τ\u{a0}")
}

/// What to type to see an episode that was not drawn, and to see it come out the same again.
fn commands(judged: &RunSummary, id: &Identity) -> [String; 2] {
    let info = &judged.run.info;
    let text = |field: &str| info[field].as_str().unwrap_or_default().to_owned();
    let (script, own) = script_of(judged);
    let mut view = vec!["softvt".to_owned(), "view".to_owned(), script];
    if own {
        view.extend(
            info["arguments"].as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned),
        );
    }
    // A policy behind a network has no word of its own in run.json.
    let policy = if info["profile"].is_object() { "ws://HOST:PORT".to_owned() } else { text("policy") };
    let mut add = |flag: &str, value: String| view.extend([flag.to_owned(), value]);
    add("--task", id.task.to_string());
    // What is so by default is left out, for a short line.
    if id.episode > 0 {
        add("--episode", id.episode.to_string());
    }
    add("--policy", policy);
    if id.seed > 0 {
        add("--seed", id.seed.to_string());
    }
    if let Some(twin) = info["twin"].as_str() {
        add("--twin", twin.to_owned());
    }
    for (flag, field) in [("--shift", "shifts"), ("--set", "set")] {
        for pair in info[field].as_array().into_iter().flatten() {
            let value = pair[1].as_str().map_or_else(|| pair[1].to_string(), str::to_owned);
            add(flag, format!("{}={value}", pair[0].as_str().unwrap_or_default()));
        }
    }
    add("--out", "seen".to_owned());
    let replay = [
        "softvt".to_owned(),
        "replay".to_owned(),
        judged.run.dir.display().to_string(),
        format!("{}/{}", id.task, id.episode),
    ];
    [view, replay.to_vec()].map(|words| words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" "))
}

/// The script that returns the suite itself, and whether it is the one that was run: a list of suites cannot be looked at.
fn script_of(judged: &RunSummary) -> (String, bool) {
    let main = judged.run.text("script");
    let beside = Path::new(main).with_file_name(format!("{}.lua", judged.run.text("suite")));
    let beside = beside.display().to_string();
    let other = beside != main && judged.run.info["sources"].get(&beside).is_some();
    if other { (beside, false) } else { (main.to_owned(), true) }
}

/// A word as a shell takes it for one.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}
