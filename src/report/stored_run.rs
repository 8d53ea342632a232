//! Finished and unfinished runs as other commands read them.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde_json::Value;

use super::run_folder::{EPISODES, RUN, RunFolderError, SUMMARY, io_error, is_torn, read_episodes};
use crate::evaluation::record::EpisodeRecord;

/// The version that made what this binary makes.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What is in a run folder.
#[derive(Clone, Debug)]
pub struct StoredRun {
    /// The folder.
    pub dir: PathBuf,
    /// `run.json`.
    pub info: Value,
    /// Its episodes, in the order of the tasks.
    pub records: Vec<EpisodeRecord>,
    /// Whether it came to its end.
    pub finished: bool,
    /// Whether its last episode was broken off while it was written.
    pub torn: bool,
}

/// Why runs cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum StoredRunError {
    /// The system refused, or a line is not an episode.
    #[error(transparent)]
    Folder(#[from] RunFolderError),
    /// The same, of a run that another version made: which is the likely cause.
    #[error("{error}; softvt {version} made this run, and this is softvt {VERSION}: read it with that one")]
    Version {
        /// What is wrong.
        error: Box<Self>,
        /// Who made it.
        version: String,
    },
    /// There is nothing of that name.
    #[error("there is no folder {dir}")]
    Missing {
        /// The folder.
        dir: String,
    },
    /// A file is not a folder.
    #[error("{path} is a file; give the folder of a run")]
    File {
        /// The file.
        path: String,
    },
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

    /// The suite's name in results: that of a twin is its own.
    pub fn suite(&self) -> &str {
        self.records.first().map_or(self.text("suite"), |record| &record.identity.suite)
    }

    /// Whether its policy sees the true state.
    pub fn is_privileged(&self) -> bool {
        self.info["privileged"].as_bool() == Some(true)
    }

    /// Whether its policy sees the true forces at the pads.
    pub fn sees_forces(&self) -> bool {
        self.info["force_observed"].as_bool() == Some(true)
    }

    /// Episodes that it has when it is done: all, or a shard's part of them.
    pub fn wanted(&self) -> usize {
        let tasks = self.info["tasks"].as_array().map_or(0, Vec::len);
        let all = tasks * self.info["episodes"].as_u64().unwrap_or(0) as usize;
        let shard = self.text("shard").split_once('/');
        match shard.and_then(|(i, n)| Some((i.parse::<usize>().ok()?, n.parse::<usize>().ok()?))) {
            Some((index, count)) if index > 0 && count > 0 => (all + count - index.min(all + count)) / count,
            _ => all,
        }
    }

    /// Whether episodes are missing: it is at work, or was broken off.
    pub fn is_partial(&self) -> bool {
        !self.finished || self.records.len() < self.wanted()
    }

    /// What a reader of its results should know: a sentence each.
    pub fn remarks(&self) -> Vec<String> {
        let mut found = Vec::new();
        let dir = self.dir.display();
        if self.is_partial() {
            found.push(format!(
                "{dir} is not finished: it has {} of {} episodes; it is at work, or goes on with --resume",
                self.records.len(),
                self.wanted()
            ));
        }
        if self.torn {
            found.push(format!(
                "the last line of {dir}/{EPISODES} was broken off while it was written and counts for nothing; \
                 --resume runs that episode again"
            ));
        }
        if self.text("softvt") != VERSION {
            found.push(format!(
                "softvt {} made {dir}, and this is softvt {VERSION}: numbers of two versions may differ",
                self.text("softvt")
            ));
        }
        found
    }
}

/// The run in a folder, or those in the folders in it, by name.
///
/// # Errors
/// There is none; one cannot be read.
pub fn load(dir: &Path) -> Result<Vec<StoredRun>, StoredRunError> {
    if dir.join(RUN).is_file() {
        return Ok(vec![one(dir)?]);
    }
    let shown = || dir.display().to_string();
    if dir.is_file() {
        return Err(StoredRunError::File { path: shown() });
    }
    let mut inner: Vec<PathBuf> = match fs::read_dir(dir) {
        Ok(entries) => entries.filter_map(Result::ok).map(|entry| entry.path()).collect(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(StoredRunError::Missing { dir: shown() });
        }
        Err(error) => return Err(io_error("read", dir)(error).into()),
    };
    inner.retain(|path| path.join(RUN).is_file());
    inner.sort();
    if inner.is_empty() {
        return Err(StoredRunError::None { dir: shown() });
    }
    inner.iter().map(|dir| one(dir)).collect()
}

fn one(dir: &Path) -> Result<StoredRun, StoredRunError> {
    let path = dir.join(RUN);
    let text = fs::read_to_string(&path).map_err(io_error("read", &path))?;
    let wrong = |what: String| StoredRunError::Info { path: path.display().to_string(), what };
    let info: Value = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    let version = info["softvt"].as_str().unwrap_or_default().to_owned();
    let read = || -> Result<StoredRun, StoredRunError> {
        for field in ["softvt", "script", "suite", "policy"] {
            if info[field].as_str().is_none() {
                return Err(wrong(format!("it has no {field}")));
            }
        }
        for (field, fits) in [("tasks", info["tasks"].is_array()), ("episodes", info["episodes"].is_u64())] {
            if !fits {
                return Err(wrong(format!("it has no {field}")));
            }
        }
        let mut records = read_episodes(dir)?;
        records.sort_by_key(|r| (r.identity.task, r.identity.episode));
        let finished = dir.join(SUMMARY).is_file();
        Ok(StoredRun { dir: dir.to_owned(), info: info.clone(), records, finished, torn: is_torn(dir) })
    };
    read().map_err(|error| match version == VERSION || version.is_empty() {
        true => error,
        false => StoredRunError::Version { error: Box::new(error), version },
    })
}
