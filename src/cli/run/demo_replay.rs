//! Re-simulation of the demonstrations of a dataset.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::{
    cli::{
        error::CliError,
        output::print,
        run::{config::thread_count, resimulate, stored_episode},
    },
    dataset::{
        TaskFile,
        layout::{DATASET, RECORDING},
        manifest,
    },
    parallel,
    report::stored_run::StoredRun,
    rollout::cancel,
    text::counted,
};

/// A demonstration: its file, and its number in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct DemoRef {
    pub file: PathBuf,
    pub demo: usize,
}

/// Result of the re-simulation of a demonstration.
struct DemoReplay {
    /// Hash of the final state.
    state_hash: String,
    /// First difference from the recording. `None` if they are byte-identical.
    difference: Option<String>,
    goal_reached: bool,
}

/// Checks that the recording in a folder is complete.
///
/// # Errors
/// It was interrupted.
pub(crate) fn check_complete(path: &Path) -> Result<(), CliError> {
    if path.is_dir() && path.join(RECORDING).is_file() && !path.join(DATASET).is_file() {
        return Err(CliError::input(format!(
            "{}: the recording was interrupted; complete it with softvt record … --resume --out {0}",
            path.display()
        )));
    }
    Ok(())
}

/// All demonstrations of a dataset folder, or of one HDF5 file.
///
/// # Errors
/// The manifest or file cannot be read.
pub(crate) fn demos_of(path: &Path) -> Result<Vec<DemoRef>, CliError> {
    if path.is_dir() {
        let entries = manifest::read(path).map_err(CliError::input)?;
        let demos =
            entries.iter().map(|entry| DemoRef { file: path.join(&entry.hdf5_path), demo: entry.demo_id });
        return Ok(demos.collect());
    }
    let file = TaskFile::open(path).map_err(CliError::input)?;
    Ok(file.demos.iter().map(|demo| DemoRef { file: path.to_owned(), demo: *demo }).collect())
}

/// Simulates demonstrations again by their actions alone. Prints for each whether the result is byte-identical, and how
/// many reach the goal.
///
/// # Errors
/// A demonstration cannot be simulated, or (exit code 1) a result differs.
pub(crate) fn replay_demos(demos: &[DemoRef]) -> Result<(), CliError> {
    let mut replays: BTreeMap<usize, DemoReplay> = BTreeMap::new();
    parallel::run(
        demos.len(),
        thread_count(None),
        cancel::requested,
        |index| replay_demo(&demos[index]),
        |index, replay| {
            replays.insert(index, replay);
            Ok(())
        },
    )?;
    if cancel::requested() {
        return Err(CliError::interrupted("interrupted"));
    }
    for (DemoRef { file, demo }, replay) in demos.iter().zip(replays.values()) {
        let result = match &replay.difference {
            None => format!("byte-identical, final state {}", replay.state_hash),
            Some(difference) => format!("differs: {difference}"),
        };
        print(&format!("{} demo_{demo}: {result}\n", file.display()));
    }
    let all = demos.len();
    let identical = replays.values().filter(|replay| replay.difference.is_none()).count();
    let reached = replays.values().filter(|replay| replay.goal_reached).count();
    if all > 1 {
        print(&format!(
            "replayed by their actions alone: {identical} of {all} byte-identical, {reached} of {all} reach the goal\n"
        ));
    }
    if identical == all {
        return Ok(());
    }
    Err(CliError::internal(format!(
        "replaying {} gave another result; softvt doctor checks whether this machine computes the published results",
        counted(all - identical, "demonstration")
    )))
}

fn replay_demo(demo: &DemoRef) -> Result<DemoReplay, CliError> {
    let file = TaskFile::open(&demo.file).map_err(CliError::input)?;
    let record = file.record(demo.demo).map_err(CliError::input)?;
    let info = file.environment().map_err(CliError::input)?["env_kwargs"].clone();
    let actions = file.actions(demo.demo).map_err(CliError::input)?;
    let stored = StoredRun {
        dir: demo.file.clone(),
        manifest: info,
        records: Vec::new(),
        is_finished: true,
        is_truncated: false,
    };
    let simulated = stored_episode::simulate(&stored, &record, actions)?;
    Ok(DemoReplay {
        difference: resimulate::difference(&record, &simulated)?,
        goal_reached: simulated.verdict.goal,
        state_hash: simulated.stats.state_hash,
    })
}
