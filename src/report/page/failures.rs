//! Episodes of a run that failed, by category: reasons, stills, and commands that show the episode.

use std::path::Path;

use maud::{Markup, html};

use super::{
    breakable,
    images::{ByteBudget, DataImage, embed_image, relative_link},
};
use crate::{
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
                @else { @for command in view_commands(run, id) { br; code { (command) } } }
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

/// Replaces spaces between numbers and units by no-break spaces.
fn with_unbreakable_units(text: &str) -> String {
    text.replace(" %", "\u{a0}%").replace("τ ", "τ\u{a0}")
}

/// Commands that render an episode without a video, and that replay it.
fn view_commands(run: &RunSummary, id: &EpisodeId) -> [String; 2] {
    let (run, manifest) = (&run.run, &run.run.manifest);
    let changes = run.changes();
    // The script that returns the suite itself: `view` does not accept a list of suites, which may be what was run.
    let main = run.text("script");
    let located = |path: &str| located(path, manifest["folder"].as_str());
    let sibling = Path::new(main).with_file_name(format!("{}.lua", run.text("suite"))).display().to_string();
    let is_main = sibling == main || manifest["sources"].get(&sibling).is_none();
    let mut view = vec![located(if is_main { main } else { &sibling })];
    if is_main {
        view.extend(changes.arguments.clone());
    }
    let mut add = |flag: &str, value: String| view.extend([flag.to_owned(), value]);
    add("--task", id.task.to_string());
    // Defaults are omitted.
    if id.episode > 0 {
        add("--episode", id.episode.to_string());
    }
    let policy = match (manifest["policy_file"].as_str(), manifest["replayed"]["run"].as_str()) {
        // A client of `softvt serve` cannot be called; its actions can be repeated.
        _ if manifest["served"] == true => run.dir.display().to_string(),
        // The address of a remote policy is not stored in run.json.
        _ if manifest["profile"].is_object() => "ws://HOST:PORT".to_owned(),
        (Some(path), _) | (None, Some(path)) => located(path),
        (None, None) => run.text("policy").to_owned(),
    };
    add("--policy", policy);
    view.extend(changes.flags());
    view.extend(["--out", "seen"].map(str::to_owned));
    let view: Vec<String> = view.iter().map(|word| quoted(word)).collect();
    let replayed = quoted(&run.dir.display().to_string());
    [
        format!("softvt view {}", view.join(" ")),
        format!(
            "softvt replay {replayed} {}/{}{}",
            id.task,
            id.episode,
            if changes.seed_hash.is_some() { " --seed-file FILE" } else { "" }
        ),
    ]
}

/// The path of a file of a run from the working folder: the path itself, or that in the folder in which the run was
/// made.
fn located(path: &str, folder: Option<&str>) -> String {
    let stored = folder.map(|folder| Path::new(folder).join(path));
    match stored.filter(|stored| !Path::new(path).exists() && stored.exists()) {
        Some(stored) => stored.display().to_string(),
        None => path.to_owned(),
    }
}

/// Quotes a word for a shell where necessary; with control characters as escapes, which a terminal does not execute.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    if word.contains(char::is_control) {
        let escape = |c: char| match c {
            '\'' | '\\' => format!("\\{c}"),
            c if c.is_control() => c.to_string().bytes().map(|byte| format!("\\x{byte:02x}")).collect(),
            c => c.to_string(),
        };
        return format!("$'{}'", word.chars().map(escape).collect::<String>());
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}
