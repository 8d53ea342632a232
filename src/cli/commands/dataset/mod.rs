//! `softvt dataset`: looking into recorded demonstrations; and simulating one again.

pub(crate) mod export;
pub(crate) mod import;
mod task_matching;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::{
    cli::{
        commands::replay::{self, EpisodeSelector},
        error::CliError,
        output::print,
        run::resimulate,
    },
    dataset::{
        TaskFile, check,
        layout::{DATASET, RECORDING},
        manifest::{self, ManifestEntry},
        stats,
    },
    parallel,
    report::stored_run::StoredRun,
    rollout::cancel,
};

/// Whether a path is that of a data set: an HDF5 file, or the folder of a recording.
pub(crate) fn is_dataset(path: &Path) -> bool {
    let hdf5 = path.extension().is_some_and(|end| end == "hdf5" || end == "h5");
    hdf5 || path.join(DATASET).is_file() || path.join(RECORDING).is_file()
}

/// Says what is wrong with a data set; `replays` of its demonstrations are simulated again.
///
/// # Errors
/// Something is wrong.
pub(crate) fn check(path: &Path, replays: usize) -> Result<(), CliError> {
    finished(path)?;
    let findings = if path.is_dir() { check::folder(path) } else { check::file(path) };
    let findings = findings.map_err(CliError::input)?;
    if !findings.problems.is_empty() {
        let count = match findings.problems.len() {
            1 => "one thing is".to_owned(),
            more => format!("{more} things are"),
        };
        let told = findings.problems.join("\n");
        return Err(CliError::input(format!("{told}\n{}: {count} wrong", path.display())));
    }
    print(&format!(
        "{} demonstrations, {} steps, {} videos: nothing is wrong\n",
        findings.demos, findings.steps, findings.videos
    ));
    repeat_all(&spread(&all(path)?, replays))
}

/// Simulates demonstrations again by their actions alone, and says of each whether it comes out the same, and of how many the
/// goal is reached.
///
/// # Errors
/// One cannot be simulated, or (exit code 1) comes out different.
fn repeat_all(demos: &[(PathBuf, usize)]) -> Result<(), CliError> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let mut done: BTreeMap<usize, ReplayOutcome> = BTreeMap::new();
    let repeat = |index: usize| repeat(&demos[index].0, demos[index].1);
    parallel::run(demos.len(), threads, cancel::requested, repeat, |index, repeated| {
        done.insert(index, repeated);
        Ok(())
    })?;
    if cancel::requested() {
        return Err(CliError::interrupted("interrupted"));
    }
    for ((file, demo), ReplayOutcome { state, different, .. }) in demos.iter().zip(done.values()) {
        let how = different.as_ref().map_or_else(
            || format!("the same to the byte, final state {state}"),
            |what| format!("does not come out the same: {what}"),
        );
        print(&format!("{} demo_{demo}: {how}\n", file.display()));
    }
    let count = |of: fn(&ReplayOutcome) -> bool| done.values().filter(|repeated| of(repeated)).count();
    let (same, goal) = (count(|one| one.different.is_none()), count(|one| one.goal));
    if demos.len() > 1 {
        let all = demos.len();
        print(&format!(
            "by their actions alone: {same} of {all} the same to the byte, {goal} of {all} reach the goal\n"
        ));
    }
    if same == demos.len() {
        return Ok(());
    }
    Err(CliError::internal(format!(
        "{} demonstrations do not come out the same; softvt doctor says whether this machine computes as published",
        demos.len() - same
    )))
}

/// Prints and draws how a data set is distributed.
///
/// # Errors
/// It cannot be read, or the drawing not written.
pub(crate) fn stats(path: &Path, out: Option<&Path>, json: bool) -> Result<(), CliError> {
    finished(path)?;
    let mut paths: Vec<PathBuf> = all(path)?.into_iter().map(|(file, _)| file).collect();
    paths.dedup();
    let spreads = stats::column_statistics(&paths).map_err(CliError::input)?;
    match json {
        true => print(&format!("{:#}\n", serde_json::json!(spreads))),
        false => print(&stats::table(&spreads)),
    }
    let beside = if path.is_dir() { path.join("stats.svg") } else { path.with_extension("stats.svg") };
    let out = out.map_or(beside, Path::to_path_buf);
    crate::files::replace(&out, stats::svg(&spreads).as_bytes()).map_err(CliError::input)?;
    crate::text::eprint_line(&format!("softvt: {}", out.display()));
    Ok(())
}

/// Simulates a demonstration again: `task/demo`, or the number of its line in the manifest or file.
///
/// # Errors
/// There is no such demonstration, or (exit code 1) it comes out different.
pub(crate) fn replay(path: &Path, which: EpisodeSelector) -> Result<(), CliError> {
    finished(path)?;
    let count = all(path)?.len();
    let none = || {
        let dir = path.display();
        CliError::input(format!(
            "{dir} has no such demonstration; it has {count}: name one by TASK/DEMO, or by its number from 0"
        ))
    };
    let (file, demo) = match which {
        EpisodeSelector::Line(line) => all(path)?.into_iter().nth(line).ok_or_else(none)?,
        EpisodeSelector::Of(task, demo) if path.is_dir() => {
            let entries = manifest::read(path).map_err(CliError::input)?;
            let fits = |entry: &&ManifestEntry| entry.task_id == task && entry.demo_id == demo as usize;
            let found: Vec<&ManifestEntry> = entries.iter().filter(fits).collect();
            match found[..] {
                [entry] => (path.join(&entry.hdf5_path), entry.demo_id),
                [] => return Err(none()),
                _ => {
                    let files: Vec<&str> = found.iter().map(|entry| entry.hdf5_path.as_str()).collect();
                    let several =
                        format!("several suites have a task {task}: name one of {}", files.join(", "));
                    return Err(CliError::input(format!("{}: {several}", path.display())));
                }
            }
        }
        EpisodeSelector::Of(_, demo) => (path.to_owned(), demo as usize),
    };
    repeat_all(&[(file, demo)])
}

/// Refuses a folder whose recording is not finished.
///
/// # Errors
/// It is not.
pub(crate) fn finished(path: &Path) -> Result<(), CliError> {
    if path.is_dir() && path.join(RECORDING).is_file() && !path.join(DATASET).is_file() {
        return Err(CliError::input(format!(
            "{}: the recording was broken off; finish it with softvt record … --resume --out {0}",
            path.display()
        )));
    }
    Ok(())
}

/// Every demonstration: its file and its number in it.
fn all(path: &Path) -> Result<Vec<(PathBuf, usize)>, CliError> {
    if path.is_dir() {
        let entries = manifest::read(path).map_err(CliError::input)?;
        return Ok(entries.iter().map(|entry| (path.join(&entry.hdf5_path), entry.demo_id)).collect());
    }
    let file = TaskFile::open(path).map_err(CliError::input)?;
    Ok(file.demos().iter().map(|demo| (path.to_owned(), *demo)).collect())
}

/// `count` of them, evenly spread, the first always.
fn spread(all: &[(PathBuf, usize)], count: usize) -> Vec<(PathBuf, usize)> {
    let count = count.min(all.len());
    (0..count).map(|i| all[i * all.len() / count].clone()).collect()
}

/// What came of a demonstration that was simulated again.
struct ReplayOutcome {
    /// Hash of the final state.
    state: String,
    /// In what it differs from what was recorded, if it does.
    different: Option<String>,
    /// Whether the goal was reached.
    goal: bool,
}

/// Simulates a demonstration again by the actions in its file.
fn repeat(path: &Path, demo: usize) -> Result<ReplayOutcome, CliError> {
    let file = TaskFile::open(path).map_err(CliError::input)?;
    let record = file.record(demo).map_err(CliError::input)?;
    let info = file.environment().map_err(CliError::input)?["env_kwargs"].clone();
    let actions = file.actions(demo).map_err(CliError::input)?;
    let stored = StoredRun { dir: path.to_owned(), info, records: Vec::new(), finished: true, torn: false };
    let simulated = replay::simulate(&stored, &record, actions)?;
    Ok(ReplayOutcome {
        different: resimulate::difference(&record, &simulated)?,
        goal: simulated.verdict.goal,
        state: simulated.stats.state_hash,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_spread_over_the_whole() {
        let all: Vec<(PathBuf, usize)> = (0..10).map(|demo| (PathBuf::from("x"), demo)).collect();
        let picked = |count| spread(&all, count).into_iter().map(|(_, demo)| demo).collect::<Vec<_>>();
        assert_eq!(picked(1), [0]);
        assert_eq!(picked(2), [0, 5]);
        assert_eq!(picked(20).len(), 10);
        assert_eq!(picked(0), [0; 0]);
    }
}
