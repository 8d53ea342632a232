//! `softvt replay RUN EPISODE`: simulation of a recorded episode, compared with its record byte by byte.

use std::path::Path;

use crate::{
    cli::{
        args::{EpisodeSelector, ReplayArgs},
        error::CliError,
        output::print,
        run::{
            demo_replay::{DemoRef, check_complete, demos_of, replay_demos},
            resimulate, stored_episode,
        },
    },
    dataset::{
        layout::is_dataset,
        manifest::{self, ManifestEntry},
    },
    evaluation::{episode_id::EpisodeIndex, record::EpisodeRecord},
    report::{
        actions,
        stored_run::{self, StoredRun},
    },
    text::counted,
};

/// Simulates an episode of a run or a demonstration of a dataset again, by its recorded actions.
///
/// # Errors
/// The run cannot be read, its scripts have changed since, or (exit code 1) the result differs.
pub(crate) fn run(args: &ReplayArgs) -> Result<(), CliError> {
    let dir = &args.run;
    if is_dataset(dir) {
        check_complete(dir)?;
        return replay_demos(&[find_demo(dir, args.episode)?]);
    }
    let stored = stored_run::load(dir).map_err(CliError::input)?;
    let [stored] = &stored[..] else {
        let names: Vec<String> = stored.iter().map(|run| run.dir.display().to_string()).collect();
        return Err(CliError::input(format!(
            "{} contains several runs; select one of {}",
            dir.display(),
            names.join(", ")
        )));
    };
    let record = find_episode(stored, args.episode)?;
    let index = record.header.id.index();
    let path = actions::path(&stored.dir, index);
    let recorded = actions::read(&path).map_err(CliError::input)?;
    let simulated = stored_episode::simulate(stored, record, recorded)?;
    match resimulate::difference(record, &simulated)? {
        None => {
            print(&format!("{index}: byte-identical, final state {}\n", simulated.stats.state_hash));
            Ok(())
        }
        Some(difference) => Err(CliError::internal(format!(
            "{index} differs: {difference}; softvt doctor checks whether this machine computes the published results"
        ))),
    }
}

fn find_episode(stored: &StoredRun, selector: EpisodeSelector) -> Result<&EpisodeRecord, CliError> {
    let found = match selector {
        EpisodeSelector::Line(line) => stored.records.get(line),
        EpisodeSelector::Episode { task, episode } => {
            let index = EpisodeIndex { task, episode };
            stored.records.iter().find(|record| record.header.id.index() == index)
        }
    };
    found.ok_or_else(|| {
        CliError::input(format!(
            "{} has no such episode; it has {}: select one by TASK/EPISODE, or by its line number from 0",
            stored.dir.display(),
            counted(stored.records.len(), "episode")
        ))
    })
}

fn find_demo(path: &Path, selector: EpisodeSelector) -> Result<DemoRef, CliError> {
    let demos = demos_of(path)?;
    let count = demos.len();
    let not_found = || {
        CliError::input(format!(
            "{} has no such demonstration; it has {count}: select one by TASK/DEMO, or by its number from 0",
            path.display()
        ))
    };
    match selector {
        EpisodeSelector::Line(line) => demos.into_iter().nth(line).ok_or_else(not_found),
        EpisodeSelector::Episode { task, episode } if path.is_dir() => {
            let entries = manifest::read(path).map_err(CliError::input)?;
            let matches = |entry: &&ManifestEntry| entry.task_id == task && entry.demo_id == episode as usize;
            let found: Vec<&ManifestEntry> = entries.iter().filter(matches).collect();
            match found[..] {
                [entry] => Ok(DemoRef { file: path.join(&entry.hdf5_path), demo: entry.demo_id }),
                [] => Err(not_found()),
                _ => {
                    let files: Vec<&str> = found.iter().map(|entry| entry.hdf5_path.as_str()).collect();
                    Err(CliError::input(format!(
                        "{}: several suites have a task {task}; select one of the files {}",
                        path.display(),
                        files.join(", ")
                    )))
                }
            }
        }
        EpisodeSelector::Episode { episode, .. } => {
            Ok(DemoRef { file: path.to_owned(), demo: episode as usize })
        }
    }
}
