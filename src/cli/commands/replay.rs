//! `softvt replay RUN EPISODE`: simulation of a recorded episode, compared with its record byte by byte.

use std::{
    path::{Path, PathBuf},
    str::FromStr,
    sync::Arc,
};

use clap::Args;

use crate::{
    error::{CliError, Exit},
    output::{Console, print},
    replays::report_replays,
};
use softvt_common::episode_id::EpisodeIndex;
use softvt_common::text::counted;
use softvt_dataset::{
    layout::is_dataset,
    manifest::{self, ManifestEntry},
};
use softvt_evaluation::record::EpisodeRecord;
use softvt_report::{
    actions,
    stored_run::{self, StoredRun},
};
use softvt_runner::{
    Observer, read_secret,
    replay::{DemoRef, SecretFile, StoredManifest, check_complete, demos_of, difference, simulate_demos},
    stored_folder::{enter_for_dataset, enter_for_run},
};

/// Simulate a recorded episode again; exit code 0 if the result is byte-identical
#[derive(Args, Debug)]
pub(crate) struct ReplayArgs {
    /// Run folder, or a dataset
    run: PathBuf,
    /// TASK/EPISODE, or the line number in episodes.jsonl, from 0
    episode: EpisodeSelector,
    /// Secret seed of a judged run
    #[arg(long, value_name = "FILE")]
    seed_file: Option<PathBuf>,
}

/// An episode of a run, or a demonstration of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum EpisodeSelector {
    /// Line number in `episodes.jsonl` or in the manifest, from 0.
    Line(usize),
    /// `TASK/EPISODE`.
    Episode { task: usize, episode: u32 },
}

impl FromStr for EpisodeSelector {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let pair = word.split_once('/').and_then(|(task, episode)| {
            Some(Self::Episode { task: task.parse().ok()?, episode: episode.parse().ok()? })
        });
        let found = pair.or_else(|| word.parse().ok().map(Self::Line));
        found.ok_or_else(|| {
            "expected TASK/EPISODE such as 3/0, or a line number of episodes.jsonl, from 0".to_owned()
        })
    }
}

/// Simulates an episode of a run or a demonstration of a dataset again, by its recorded actions.
///
/// # Errors
/// The run cannot be read, its scripts have changed since, or (exit code 1) the result differs.
pub(super) fn run(args: &ReplayArgs) -> Result<(), CliError> {
    let dir = &args.run;
    let observer: Arc<dyn Observer> = Arc::new(Console::default());
    let secret = args.seed_file.as_ref().map(|path| {
        Ok::<_, CliError>(SecretFile { path: path.clone(), secret: read_secret(path, &*observer)? })
    });
    let secret = secret.transpose()?;
    if is_dataset(dir) {
        if secret.is_some() {
            return Err(CliError::input("--seed-file: demonstrations have no secret seed; leave it out"));
        }
        check_complete(dir)?;
        let demos = [find_demo(&enter_for_dataset(dir, &*observer)?, args.episode)?];
        return report_replays(&demos, &simulate_demos(&demos, &observer)?);
    }
    let stored = stored_run::load(dir)?;
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
    let dir = enter_for_run(stored, &*observer)?;
    let path = actions::path(&dir, index);
    let manifest =
        StoredManifest { path: &dir, manifest: &stored.manifest, secret: secret.as_ref(), observer };
    let simulated = manifest.simulate(record, actions::read(&path)?)?;
    match difference(record, &simulated)? {
        None => print(&format!("{index}: byte-identical, final state {}\n", simulated.stats.state_hash)),
        Some(difference) => Err(CliError::new(
            Exit::Internal,
            format!(
                "{index} differs: {difference}; softvt doctor checks whether this machine computes the published results"
            ),
        )),
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
            let entries = manifest::read(path)?;
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
