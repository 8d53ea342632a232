//! [`EpisodeSelector`]: the episode of a run or the demonstration of a dataset that a command names.

use std::{path::Path, str::FromStr};

use crate::{
    error::RunError,
    replay::{DemoRef, demos_of},
};
use softvt_common::{episode_id::EpisodeIndex, text::counted};
use softvt_dataset::manifest::{self, ManifestEntry};
use softvt_runs::{record::EpisodeRecord, stored_run::StoredRun};

/// An episode of a run, or a demonstration of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EpisodeSelector {
    /// Line number in `episodes.jsonl` or in the manifest, from 0.
    Line(usize),
    /// `TASK/EPISODE`.
    Episode {
        task: usize,
        /// Index of the episode of the task, or of the demonstration in its file.
        episode: u32,
    },
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

impl EpisodeSelector {
    /// The record of the episode in a run.
    pub fn find_record(self, stored: &StoredRun) -> Result<&EpisodeRecord, RunError> {
        let found = match self {
            Self::Line(line) => stored.records.get(line),
            Self::Episode { task, episode } => stored.record(EpisodeIndex { task, episode }),
        };
        found.ok_or_else(|| {
            RunError::input(format_args!(
                "{} has no such episode; it has {}: select one by TASK/EPISODE, or by its line number from 0",
                stored.dir.display(),
                counted(stored.records.len(), "episode")
            ))
        })
    }

    /// The demonstration in a dataset folder, or in one HDF5 file.
    ///
    /// # Errors
    /// The dataset cannot be read, or has no such demonstration.
    pub fn find_demo(self, path: &Path) -> Result<DemoRef, RunError> {
        let demos = demos_of(path)?;
        let count = demos.len();
        let not_found = || {
            RunError::input(format_args!(
                "{} has no such demonstration; it has {count}: select one by TASK/DEMO, or by its number from 0",
                path.display()
            ))
        };
        match self {
            Self::Line(line) => demos.into_iter().nth(line).ok_or_else(not_found),
            Self::Episode { task, episode } if path.is_dir() => {
                let entries = manifest::read(path)?;
                let matches =
                    |entry: &&ManifestEntry| entry.task_id == task && entry.demo_id == episode as usize;
                let found: Vec<&ManifestEntry> = entries.iter().filter(matches).collect();
                match found[..] {
                    [entry] => Ok(DemoRef { file: path.join(&entry.hdf5_path), demo: entry.demo_id }),
                    [] => Err(not_found()),
                    _ => {
                        let files: Vec<&str> = found.iter().map(|entry| entry.hdf5_path.as_str()).collect();
                        Err(RunError::input(format_args!(
                            "{}: several suites have a task {task}; select one of the files {}",
                            path.display(),
                            files.join(", ")
                        )))
                    }
                }
            }
            Self::Episode { episode, .. } => Ok(DemoRef { file: path.to_owned(), demo: episode as usize }),
        }
    }
}
