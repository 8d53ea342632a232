//! Command lines that show or repeat the episodes of a run.

use std::path::Path;

use softvt_common::episode_id::EpisodeId;
use softvt_evaluation::category::EpisodeCategory;
use softvt_runs::{manifest::RunManifest, record::EpisodeRecord, stored_run::StoredRun};

pub fn view_command(run: &StoredRun, id: &EpisodeId) -> String {
    let RunManifest { script: main, suite, sources, folder, .. } = &run.manifest;
    let changes = run.manifest.changes();
    // Of a list of suites, the script that returns the suite itself: `view` does not accept a list.
    let located = |path: &str| located(path, folder.as_deref());
    let sibling = Path::new(main).with_file_name(format!("{suite}.lua")).display().to_string();
    let is_main = !run.manifest.several_suites || sibling == *main || !sources.contains_key(&sibling);
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
    let RunManifest { policy, policy_file, profile, replayed, .. } = &run.manifest;
    let policy = match policy_file.as_ref().or(replayed.as_ref().map(|source| &source.run)) {
        // Neither a client of `softvt serve` nor a policy server can be called; their actions can be repeated.
        _ if profile.is_some() => run.dir.display().to_string(),
        Some(path) => located(path),
        None => policy.clone(),
    };
    add("--policy", policy);
    view.extend(changes.flags());
    view.extend(["--out", "seen"].map(str::to_owned));
    let view: Vec<String> = view.iter().map(|word| quoted(word)).collect();
    format!("softvt view {}", view.join(" "))
}

pub fn replay_command(run: &StoredRun, id: &EpisodeId) -> String {
    let secret = if run.manifest.seed_hash.is_some() { " --seed-file FILE" } else { "" };
    format!("softvt replay {} {}/{}{secret}", quoted(&run.dir.display().to_string()), id.task, id.episode)
}

/// The commands that a reader of the results of a run may want next: the report, and a view of the worst episode.
pub fn next_commands(run: &StoredRun) -> Vec<String> {
    let report = format!("softvt report {}", quoted(&run.dir.display().to_string()));
    let view = worst_episode(&run.records).map(|record| view_command(run, &record.header.id));
    [report].into_iter().chain(view).collect()
}

/// The episode farthest over its limit, or another one that failed; `None` if none failed.
fn worst_episode(records: &[EpisodeRecord]) -> Option<&EpisodeRecord> {
    let of = |category: EpisodeCategory| records.iter().filter(move |record| record.category() == category);
    let ratio = |record: &EpisodeRecord| record.d_over_tau().unwrap_or(0.0);
    let over = of(EpisodeCategory::OverLimit).max_by(|a, b| ratio(a).total_cmp(&ratio(b)));
    over.or_else(|| EpisodeCategory::ALL.into_iter().skip(1).find_map(|category| of(category).next()))
}

/// The path of a file of a run from the working folder: the path itself, or that in the folder in which
/// the run was made.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{run_summary::tests::stored, sample_record};

    #[test]
    fn the_script_of_a_view_is_that_of_the_run_unless_it_returned_a_list() {
        let mut run = stored("runs/a", "noop", vec![sample_record()]);
        let id = run.records[0].header.id.clone();
        let sibling = format!("{}.lua", run.manifest.suite);
        run.manifest.sources.insert(sibling.clone(), String::new());
        assert!(view_command(&run, &id).starts_with("softvt view x.lua "));
        run.manifest.several_suites = true;
        assert!(view_command(&run, &id).starts_with(&format!("softvt view {sibling} ")));
    }

    #[test]
    fn the_next_commands_are_the_report_and_the_episode_farthest_over_the_limit() {
        let record = |episode: u32, d: f64| {
            let mut record = sample_record();
            (record.header.id.episode, record.verdict.object_mut().d_peak) = (episode, Some(d));
            (record.verdict.object_mut().deformation_ok, record.verdict.safety) = (Some(d <= 1.0), d <= 1.0);
            record
        };
        let run = stored("runs/a", "noop", vec![record(0, 1.5), record(1, 9.0), record(2, 0.5)]);
        let view = "softvt view x.lua --task 0 --episode 1 --policy noop --seed 11 --out seen";
        assert_eq!(next_commands(&run), ["softvt report runs/a", view]);
        let safe = stored("runs/a", "noop", vec![record(2, 0.5)]);
        assert_eq!(next_commands(&safe).len(), 1);
    }
}
