//! Attempts at the episodes of a run whose policy is outside of softvt: a server, a client of `softvt serve`, or a
//! policy in Rust. Such a policy can break off an episode that it would lose, and get it again when the run is resumed.
//!
//! An attempt begins with the first action that is executed. It is on the disk before the second, and the record of the
//! episode has the number of its attempts. A policy of softvt or in Lua does the same in each attempt; none is counted.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Mutex,
};

use super::run_folder::{ATTEMPTS, RunFolderError, of_folder};
use softvt_common::{
    episode_id::EpisodeIndex,
    files,
    journal::{Journal, whole_lines},
    parallel::lock,
};

/// The attempts at the episodes of one run, of all its sessions. Their file exists until the run is complete.
pub struct Attempts {
    path: PathBuf,
    begun: Mutex<BegunAttempts>,
}

#[derive(Default)]
struct BegunAttempts {
    file: Option<Journal>,
    counts: BTreeMap<EpisodeIndex, u32>,
}

impl Attempts {
    /// The attempts of earlier sessions in the folder of a run.
    pub fn open(dir: &Path) -> Result<Self, RunFolderError> {
        let (path, mut begun) = (dir.join(ATTEMPTS), BegunAttempts::default());
        if path.is_file() {
            let (mut file, bytes) = Journal::resume(&path).map_err(of_folder(dir, ATTEMPTS))?;
            file.keep_whole_lines(&bytes)?;
            begun.file = Some(file);
            for (number, line) in whole_lines(&bytes) {
                let index = serde_json::from_slice(line).map_err(|error| {
                    RunFolderError::in_line(&path, number, format_args!("not an attempt: {error}"))
                })?;
                *begun.counts.entry(index).or_insert(0) += 1;
            }
        }
        Ok(Self { path, begun: Mutex::new(begun) })
    }

    /// Writes that an attempt at an episode has begun.
    pub fn begin(&self, index: EpisodeIndex) -> Result<(), RunFolderError> {
        let mut begun = lock(&self.begun);
        *begun.counts.entry(index).or_insert(0) += 1;
        let line = files::json_lines(&self.path, [index])?;
        let file = match begun.file.take() {
            Some(file) => file,
            None => {
                let folder = self.path.parent().unwrap_or(&self.path);
                Journal::resume(&self.path).map_err(of_folder(folder, ATTEMPTS))?.0
            }
        };
        Ok(begun.file.insert(file).append(&line)?)
    }

    /// Number of attempts at an episode, if there were several.
    pub fn several(&self, index: EpisodeIndex) -> Option<u32> {
        lock(&self.begun).counts.get(&index).copied().filter(|count| *count > 1)
    }

    /// True before the first attempt at any episode.
    pub fn is_empty(&self) -> bool {
        lock(&self.begun).counts.is_empty()
    }

    /// Removes the file of a complete run, whose records have the numbers.
    pub fn remove(&self) -> Result<(), RunFolderError> {
        lock(&self.begun).file = None;
        Ok(files::remove_if_present(&self.path)?)
    }
}
