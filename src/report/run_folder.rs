//! The folder of a run: `run.json`, `episodes.jsonl`, `summary.json` and what else belongs to it.
//!
//! An episode's line is written and synced as soon as its turn has come: lines keep the order of the episodes, whatever
//! thread finished first, so that the file's bytes do not depend on the number of threads.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
};

use serde::Serialize;

use crate::evaluation::record::EpisodeRecord;

/// One line an episode.
pub const EPISODES: &str = "episodes.jsonl";
/// Everything needed to repeat the run.
pub const RUN: &str = "run.json";
/// What the run says.
pub const SUMMARY: &str = "summary.json";

/// Why a run folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RunFolderError {
    /// It holds another run.
    #[error("{dir} already holds a run ({found}): give another folder with --out, or remove it")]
    Occupied {
        /// The folder.
        dir: String,
        /// What was found in it.
        found: &'static str,
    },
    /// The system refused.
    #[error("cannot {action} {path}: {source}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which file.
        path: String,
        /// What the system said.
        source: io::Error,
    },
    /// A record cannot be written as JSON.
    #[error("cannot write {path} as JSON: {source}")]
    Json {
        /// The file.
        path: String,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A line is not an episode.
    #[error("{path}:{line}: not an episode record: {source}")]
    BadLine {
        /// The file.
        path: String,
        /// Line number, from 1.
        line: usize,
        /// What is wrong.
        source: serde_json::Error,
    },
}

/// The folder of a run in progress.
#[derive(Debug)]
pub struct RunFolder {
    dir: PathBuf,
    episodes: File,
    next: usize,
    held: BTreeMap<usize, String>,
}

impl RunFolder {
    /// Whether a run may be kept in `dir`.
    ///
    /// # Errors
    /// It holds a run.
    pub fn check(dir: &Path) -> Result<(), RunFolderError> {
        match [RUN, EPISODES, SUMMARY].into_iter().find(|name| dir.join(name).exists()) {
            Some(found) => Err(RunFolderError::Occupied { dir: dir.display().to_string(), found }),
            None => Ok(()),
        }
    }

    /// Makes `dir`, with the folders above it, and an empty `episodes.jsonl` in it.
    ///
    /// # Errors
    /// The folder holds a run, or cannot be made or written to.
    pub fn create(dir: &Path) -> Result<Self, RunFolderError> {
        fs::create_dir_all(dir).map_err(io_error("make the folder", dir))?;
        Self::check(dir)?;
        let path = dir.join(EPISODES);
        // `create_new`: of two runs started at once on one folder, one must lose here.
        let episodes = OpenOptions::new().append(true).create_new(true).open(&path).map_err(|source| {
            match source.kind() {
                io::ErrorKind::AlreadyExists => {
                    RunFolderError::Occupied { dir: dir.display().to_string(), found: EPISODES }
                }
                _ => io_error("make", &path)(source),
            }
        })?;
        Ok(Self { dir: dir.into(), episodes, next: 0, held: BTreeMap::new() })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.dir
    }

    /// Takes the record of the `index`-th episode of the run (from 0). It is on disk when this returns, unless an
    /// earlier episode is still running; then it is written with that one, or by [`RunFolder::flush`].
    ///
    /// # Errors
    /// The line cannot be written.
    pub fn append(&mut self, index: usize, record: &EpisodeRecord) -> Result<(), RunFolderError> {
        let mut line = serde_json::to_string(record).map_err(|source| RunFolderError::Json {
            path: self.dir.join(EPISODES).display().to_string(),
            source,
        })?;
        line.push('\n');
        self.held.insert(index, line);
        while let Some(line) = self.held.remove(&self.next) {
            self.write_line(&line)?;
            self.next += 1;
        }
        Ok(())
    }

    /// Writes finished episodes that still wait for an earlier one: the run was interrupted and that one will not come.
    ///
    /// # Errors
    /// A line cannot be written.
    pub fn flush(&mut self) -> Result<(), RunFolderError> {
        while let Some((index, line)) = self.held.pop_first() {
            self.write_line(&line)?;
            self.next = index + 1;
        }
        Ok(())
    }

    /// Takes back what was written of a run that has no episode; the folder itself goes too if nothing else is in it.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn discard(self) -> Result<(), RunFolderError> {
        for name in [RUN, EPISODES] {
            let path = self.dir.join(name);
            match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(io_error("remove", &path)(source));
                }
                _ => {}
            }
        }
        // It may hold the user's own files; then it stays.
        let _ = fs::remove_dir(&self.dir);
        Ok(())
    }

    /// Writes `value` as indented JSON to the file `name` of the folder, aside and then renamed: a reader sees the old
    /// file or the new one, never a part.
    ///
    /// # Errors
    /// The value is no JSON, or the file cannot be written.
    pub fn write_json<T: Serialize>(&self, name: &str, value: &T) -> Result<(), RunFolderError> {
        let path = self.dir.join(name);
        let text = serde_json::to_string_pretty(value)
            .map_err(|source| RunFolderError::Json { path: path.display().to_string(), source })?;
        replace(&path, &(text + "\n"))
    }

    /// One write and one sync a line: after a crash the file ends in at most one torn line.
    fn write_line(&mut self, line: &str) -> Result<(), RunFolderError> {
        let path = self.dir.join(EPISODES);
        self.episodes.write_all(line.as_bytes()).map_err(io_error("write to", &path))?;
        self.episodes.sync_data().map_err(io_error("sync", &path))
    }
}

/// Replaces `path` by `content`: written aside, synced, renamed.
///
/// # Errors
/// The file cannot be written.
pub fn replace(path: &Path, content: impl AsRef<[u8]>) -> Result<(), RunFolderError> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(".part");
    let aside = path.with_file_name(name);
    // Made anew: what a link of that name leads to must not be written to.
    match fs::remove_file(&aside) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            return Err(io_error("replace", &aside)(source));
        }
        _ => {}
    }
    let mut file =
        OpenOptions::new().write(true).create_new(true).open(&aside).map_err(io_error("make", &aside))?;
    file.write_all(content.as_ref()).map_err(io_error("write to", &aside))?;
    file.sync_all().map_err(io_error("sync", &aside))?;
    fs::rename(&aside, path).map_err(io_error("replace", path))
}

/// Reads the episodes of a run folder. A last line that was torn by a crash is left out.
///
/// # Errors
/// The file cannot be read, or another line is not an episode.
pub fn read_episodes(dir: &Path) -> Result<Vec<EpisodeRecord>, RunFolderError> {
    let path = dir.join(EPISODES);
    let bytes = fs::read(&path).map_err(io_error("read", &path))?;
    let torn = !bytes.ends_with(b"\n");
    let lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
    let last = lines.len() - 1;
    let mut records = Vec::with_capacity(last);
    for (i, line) in lines.iter().enumerate().filter(|(_, line)| !line.is_empty()) {
        match serde_json::from_slice(line) {
            Ok(record) => records.push(record),
            Err(_) if torn && i == last => {}
            Err(source) => {
                let path = path.display().to_string();
                return Err(RunFolderError::BadLine { path, line: i + 1, source });
            }
        }
    }
    Ok(records)
}

pub(super) fn io_error(
    action: &'static str,
    path: &Path,
) -> impl FnOnce(io::Error) -> RunFolderError + use<> {
    let path = path.display().to_string();
    move |source| RunFolderError::Io { action, path, source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::record::tests::sample;

    fn episode(index: u32) -> EpisodeRecord {
        let mut record = sample();
        record.identity.episode = index;
        record
    }

    fn indices(dir: &Path) -> Vec<u32> {
        read_episodes(dir).unwrap().iter().map(|r| r.identity.episode).collect()
    }

    #[test]
    fn lines_keep_the_order_of_the_episodes_whatever_finished_first() {
        let root = tempfile::tempdir().unwrap();
        let dir = root.path().join("deep/run");
        let mut folder = RunFolder::create(&dir).unwrap();
        folder.append(1, &episode(1)).unwrap();
        assert!(indices(&dir).is_empty());
        folder.append(0, &episode(0)).unwrap();
        assert_eq!(indices(&dir), [0, 1]);
        folder.append(3, &episode(3)).unwrap();
        folder.flush().unwrap();
        assert_eq!(indices(&dir), [0, 1, 3]);
        assert_eq!(read_episodes(&dir).unwrap()[0], episode(0));
    }

    #[test]
    fn a_folder_with_a_run_is_refused_and_left_alone() {
        let root = tempfile::tempdir().unwrap();
        let mut folder = RunFolder::create(root.path()).unwrap();
        folder.append(0, &episode(0)).unwrap();
        let error = RunFolder::create(root.path()).unwrap_err().to_string();
        assert!(error.contains("already holds a run (episodes.jsonl)") && error.contains("--out"), "{error}");
        assert_eq!(indices(root.path()), [0]);
        fs::remove_file(root.path().join(EPISODES)).unwrap();
        folder.write_json(RUN, &1).unwrap();
        assert!(RunFolder::create(root.path()).unwrap_err().to_string().contains("run.json"));
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_named() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("file");
        fs::write(&file, "x").unwrap();
        let error = RunFolder::create(&file.join("run")).unwrap_err().to_string();
        assert!(error.starts_with("cannot make the folder") && error.contains("file/run"), "{error}");
    }

    #[test]
    fn a_torn_last_line_is_left_out_and_a_bad_line_before_it_is_not() {
        let root = tempfile::tempdir().unwrap();
        let mut folder = RunFolder::create(root.path()).unwrap();
        (0..2).for_each(|i| folder.append(i, &episode(i as u32)).unwrap());
        let path = root.path().join(EPISODES);
        let whole = fs::read_to_string(&path).unwrap();
        for cut in [1, 2, whole.len() / 4] {
            fs::write(&path, &whole[..whole.len() - cut]).unwrap();
            let expected: &[u32] = if cut == 1 { &[0, 1] } else { &[0] };
            assert_eq!(indices(root.path()), expected, "{cut} bytes lost");
        }
        fs::write(&path, format!("{{\"suite\":\n{whole}")).unwrap();
        let error = read_episodes(root.path()).unwrap_err().to_string();
        assert!(error.contains("episodes.jsonl:1: not an episode record"), "{error}");
    }

    #[test]
    fn json_is_replaced_whole_and_nothing_stays_aside() {
        let root = tempfile::tempdir().unwrap();
        let folder = RunFolder::create(root.path()).unwrap();
        folder.write_json(SUMMARY, &vec![1, 2]).unwrap();
        folder.write_json(SUMMARY, &vec![3]).unwrap();
        assert_eq!(fs::read_to_string(root.path().join(SUMMARY)).unwrap(), "[\n  3\n]\n");
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 2);
    }
}
