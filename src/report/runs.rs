//! Finished and unfinished runs as other commands read them.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde_json::Value;

use super::run_folder::{EPISODES, RUN, RunFolderError, io_error, read_episodes};
use crate::evaluation::record::EpisodeRecord;

/// What is in a run folder.
#[derive(Clone, Debug)]
pub struct StoredRun {
    /// The folder.
    pub dir: PathBuf,
    /// `run.json`.
    pub info: Value,
    /// Its episodes, in the order of the tasks.
    pub records: Vec<EpisodeRecord>,
}

/// Why runs cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RunsError {
    /// The system refused, or a line is not an episode.
    #[error(transparent)]
    Folder(#[from] RunFolderError),
    /// There is no run.
    #[error("{dir} holds no run: neither it nor a folder in it has {RUN} and {EPISODES}")]
    None {
        /// The folder.
        dir: String,
    },
    /// A file is not what its name says.
    #[error("{path}: not that of a run: {what}")]
    Info {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
}

impl StoredRun {
    /// A text of `run.json`.
    pub fn text(&self, field: &str) -> &str {
        self.info[field].as_str().unwrap_or_default()
    }

    /// Suite and policy.
    pub fn suite_and_policy(&self) -> (&str, &str) {
        (self.text("suite"), self.text("policy"))
    }
}

/// The run in a folder, or those in the folders in it, by name.
///
/// # Errors
/// There is none; one cannot be read.
pub fn load(dir: &Path) -> Result<Vec<StoredRun>, RunsError> {
    if dir.join(RUN).is_file() {
        return Ok(vec![one(dir)?]);
    }
    let mut inner: Vec<PathBuf> = match fs::read_dir(dir) {
        Ok(entries) => entries.filter_map(Result::ok).map(|entry| entry.path()).collect(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(io_error("read", dir)(error).into()),
    };
    inner.retain(|path| path.join(RUN).is_file());
    inner.sort();
    if inner.is_empty() {
        return Err(RunsError::None { dir: dir.display().to_string() });
    }
    inner.iter().map(|dir| one(dir)).collect()
}

fn one(dir: &Path) -> Result<StoredRun, RunsError> {
    let path = dir.join(RUN);
    let text = fs::read_to_string(&path).map_err(io_error("read", &path))?;
    let wrong = |what: String| RunsError::Info { path: path.display().to_string(), what };
    let info: Value = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    for field in ["softvt", "script", "suite", "policy"] {
        if info[field].as_str().is_none() {
            return Err(wrong(format!("it has no {field}")));
        }
    }
    let mut records = read_episodes(dir)?;
    records.sort_by_key(|r| (r.identity.task, r.identity.episode));
    Ok(StoredRun { dir: dir.to_owned(), info, records })
}
