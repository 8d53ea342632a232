//! Episodes of a run that failed, as cards by category: reasons, stills, and commands that show the episode.

use std::path::Path;

use maud::{Markup, html};

use super::{
    images::{ByteBudget, DataImage, embed_image, relative_link},
    marks::class,
    subheading,
};
use crate::{
    commands::{replay_command, view_command},
    run_summary::{RunSummary, UnsafeEpisode},
    task_names::object_name,
    video::{still_path, video_path},
};
use softvt_common::text::{counted, decimal};
use softvt_evaluation::category::EpisodeCategory;

/// Largest number of episodes of a category listed per run.
const MAX_LISTED: usize = 24;
/// Largest size of all stills of a page, bytes before they are text.
const MAX_STILL_BYTES: usize = 200_000;

/// Failed episodes of all runs, for a page in the folder `out`.
pub(super) fn failures(runs: &[RunSummary], out: &Path) -> Markup {
    // The budget is divided among the runs with stills, so that the first run cannot exhaust it.
    let has_stills = |run: &&RunSummary| run.run.dir.join("video").is_dir();
    let budget = MAX_STILL_BYTES / runs.iter().filter(has_stills).count().max(1);
    let (failed, safe): (Vec<&RunSummary>, Vec<&RunSummary>) =
        runs.iter().partition(|run| !run.unsafe_episodes().is_empty());
    let episodes: usize = safe.iter().map(|run| run.run.records.len()).sum();
    let is_soft = safe.iter().all(|run| run.is_soft());
    html! {
        @if failed.is_empty() && safe.len() > 1 && is_soft && episodes > 0 {
            p.note { "All " (counted(episodes, "episode")) " of " (counted(safe.len(), "run")) " are safe." }
        } @else if !safe.is_empty() {
            ul.safe { @for run in safe { li { b { (run.name()) } ": " (without_failures(run)) } } }
        }
        @for (i, run) in failed.into_iter().enumerate() {
            (subheading(format_args!("failures-{i}"), &run.name()))
            (failures_of_run(run, out, budget))
        }
    }
}

fn without_failures(run: &RunSummary) -> Markup {
    let count = run.run.records.len();
    html! {
        @if count == 0 { "There is no episode yet." }
        @else {
            @if count == 1 { "The episode " } @else { "All " (count) " episodes " }
            @match (run.is_soft(), count) {
                (false, _) => "reached the goal without a drop.",
                (true, 1) => "is safe.",
                (true, _) => "are safe.",
            }
        }
    }
}

fn failures_of_run(run: &RunSummary, out: &Path, budget: usize) -> Markup {
    let all = run.unsafe_episodes();
    let mut budget = ByteBudget(budget);
    html! {
        @for category in EpisodeCategory::ALL {
            @let group: Vec<&UnsafeEpisode> =
                all.iter().filter(|episode| episode.record.category() == category).collect();
            @if !group.is_empty() {
                h4 class=(class(category)) {
                    (category.glyph()) " " (category.name()) ": " (group.len()) " of " (counted(run.run.records.len(), "episode"))
                    @if group.len() > MAX_LISTED { "; the first " (MAX_LISTED) " are shown" }
                }
                ul.failures {
                    @for episode in group.iter().take(MAX_LISTED) { (card(run, episode, out, &mut budget)) }
                }
            }
        }
    }
}

fn card(run: &RunSummary, episode: &UnsafeEpisode, out: &Path, budget: &mut ByteBudget) -> Markup {
    let header = &episode.record.header;
    let id = &header.id;
    let video = relative_link(out, &video_path(&run.run.dir, id.index()));
    let title = format!("Task {} episode {}", id.task, id.episode);
    let still = embed_image(&still_path(&run.run.dir, id.index()), budget);
    let image = still.map(|DataImage { url, width, height }| {
        let result = episode.record.result_and_harm();
        let alt = format!("{title}, {}, {result}, coloured by strain", object_name(&header.asset));
        html! { img src=(url) width=(width) height=(height) alt=(alt); }
    });
    html! {
        li class=(class(episode.record.category())) {
            @match (image, &video) {
                (Some(image), Some(video)) => a href=(video) { (image) },
                (Some(image), None) => (image),
                (None, _) => "",
            }
            p {
                b { (object_name(&header.asset)) }
                span.interval { (title) @if let Some(video) = &video { " · " a href=(video) { "video" span.hidden { " of task " (id.task) " episode " (id.episode) } } } }
                @if let Some(ratio) = episode.record.d_over_tau().filter(|ratio| *ratio > 1.0) {
                    span.amount {
                        (decimal(Some(ratio), 1)) "\u{a0}× limit"
                        @if let Some(pct) = episode.record.crushed_volume_pct() { ", crushed: " (decimal(Some(pct), 0)) "\u{a0}% collapsed" }
                    }
                }
                (with_unbreakable_units(&episode.reason))
            }
            @if video.is_none() {
                details { summary { "Commands" span.hidden { " for task " (id.task) " episode " (id.episode) } } code { (view_command(&run.run, id)) } code { (replay_command(&run.run, id)) } }
            }
        }
    }
}

/// Replaces spaces between numbers and units by no-break spaces.
fn with_unbreakable_units(text: &str) -> String {
    text.replace(" %", "\u{a0}%").replace("τ ", "τ\u{a0}")
}
