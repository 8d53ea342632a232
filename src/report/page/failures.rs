//! Episodes of a run that failed, by category: reasons, stills, and commands that show the episode.

use std::path::Path;

use maud::{Markup, html};

use super::{
    breakable,
    images::{ByteBudget, DataImage, embed_image, relative_link},
};
use crate::{
    commands::{replay_command, view_command},
    run_summary::{RunSummary, UnsafeEpisode},
    video::{still_path, video_path},
};
use softvt_common::episode_id::EpisodeId;
use softvt_common::text::counted;
use softvt_evaluation::category::EpisodeCategory;
use softvt_records::record::EpisodeHeader;

/// Largest number of episodes listed per run.
const MAX_LISTED: usize = 60;
/// Largest size of all stills of a page, bytes.
const MAX_STILL_BYTES: usize = 12 << 20;

/// Unsafe episodes of all runs, for a page in the folder `out`.
pub(super) fn failures(runs: &[RunSummary], out: &Path) -> Markup {
    // The budget is divided among the runs, so that the first run cannot exhaust it.
    let budget = MAX_STILL_BYTES / runs.len().max(1);
    html! { @for run in runs { h3 { (run.name()) } (failures_of_run(run, out, budget)) } }
}

fn failures_of_run(run: &RunSummary, out: &Path, budget: usize) -> Markup {
    let all = run.unsafe_episodes();
    let count = run.run.records.len();
    if all.is_empty() {
        let what = match (run.is_soft(), count) {
            (false, _) => "reached the goal without a drop",
            (true, 1) => "is safe",
            (true, _) => "are safe",
        };
        let note = match count {
            0 => "There is no episode yet.".to_owned(),
            _ => format!(
                "{} {what}.",
                if count == 1 { "The episode".to_owned() } else { format!("All {count} episodes") }
            ),
        };
        return html! { p.note { (note) } };
    }
    let listed = &all[..all.len().min(MAX_LISTED)];
    let mut budget = ByteBudget(budget);
    let rest =
        if all.len() > MAX_LISTED { format!("; the first {MAX_LISTED} are listed") } else { String::new() };
    html! {
        p.note { (all.len()) " of " (counted(count, "episode")) " failed" (rest) "." }
        @for category in EpisodeCategory::ALL {
            @let group: Vec<&UnsafeEpisode> =
                listed.iter().filter(|episode| episode.record.category() == category).collect();
            @if !group.is_empty() { (failures_of_category(run, category, &group, out, &mut budget)) }
        }
    }
}

fn failures_of_category(
    run: &RunSummary,
    category: EpisodeCategory,
    episodes: &[&UnsafeEpisode],
    out: &Path,
    budget: &mut ByteBudget,
) -> Markup {
    let stills: Vec<Markup> =
        episodes.iter().filter_map(|episode| still(run, episode, out, budget)).collect();
    let label = format!("Episodes of {}: {}", run.name(), category.name());
    html! {
        h4 { (category.glyph()) " " (category.name()) ": " (counted(episodes.len(), "episode")) }
        @if !stills.is_empty() { div.stills { @for still in &stills { (still) } } }
        div.scroll tabindex="0" role="group" aria-label=(label) {
            table.failures.cards {
                thead {
                    tr {
                        th.number scope="col" { "Task" }
                        th.number scope="col" { "Episode" }
                        th.text scope="col" { "Object" }
                        th.text scope="col" { "Reason, and how to view it" }
                    }
                }
                tbody { @for episode in episodes { (failure_row(run, episode, out)) } }
            }
        }
    }
}

fn failure_row(run: &RunSummary, episode: &UnsafeEpisode, out: &Path) -> Markup {
    let header = &episode.record.header;
    let id = &header.id;
    let video = relative_link(out, &video_path(&run.run.dir, id.index()));
    html! {
        tr {
            th.number scope="row" data-head="Task" { (id.task) }
            td.number data-head="Episode" { (id.episode) }
            td.text data-head="Object" { (breakable(&header.asset)) }
            td.text data-head="Reason" {
                (with_unbreakable_units(&episode.reason))
                @if let Some(video) = video { br; a href=(video) { "video" } }
                @else { @for command in commands(run, id) { br; code { (command) } } }
            }
        }
    }
}

/// Still of the worst moment of an episode, if it was rendered.
fn still(run: &RunSummary, episode: &UnsafeEpisode, out: &Path, budget: &mut ByteBudget) -> Option<Markup> {
    let EpisodeHeader { id, asset, .. } = &episode.record.header;
    let title = format!("Task {} episode {}", id.task, id.episode);
    let DataImage { url, width, height } = embed_image(&still_path(&run.run.dir, id.index()), budget)?;
    let alt = format!(
        "{title}, {}, at its worst moment: third-person and wrist camera above, left and right finger below, deformation at the bottom",
        asset
    );
    let image = html! { img src=(url) width=(width) height=(height) alt=(alt) loading="lazy"; };
    let image = match relative_link(out, &video_path(&run.run.dir, id.index())) {
        Some(video) => html! { a href=(video) { (image) } },
        None => image,
    };
    let caption = with_unbreakable_units(&episode.reason);
    Some(html! { figure.still { (image) figcaption { b { (title) } ": " (caption) } } })
}

/// Commands that render an episode without a video, and that replay it.
fn commands(run: &RunSummary, id: &EpisodeId) -> [String; 2] {
    [view_command(&run.run, id), replay_command(&run.run, id)]
}

/// Replaces spaces between numbers and units by no-break spaces.
fn with_unbreakable_units(text: &str) -> String {
    text.replace(" %", "\u{a0}%").replace("τ ", "τ\u{a0}")
}
