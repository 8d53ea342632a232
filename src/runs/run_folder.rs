//! The folder of a run: `run.json`, `episodes.jsonl`, `summary.json` and the files of the episodes.
//!
//! The line of an episode is written and synced when the episode ends, after its other files: an episode with a line is
//! complete. Each line ends with its digest ([`record_line`](super::record_line)). At the end of a run the lines are
//! sorted by episode, so that the file's bytes depend neither on the number of threads nor on interruptions.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use super::{
    manifest::RunManifest,
    record::EpisodeRecord,
    record_line::{LineError, read_line, write_line},
    softvtbench_files,
};
use softvt_common::{
    episode_id::EpisodeIndex,
    files::{self, FileError},
    journal::{Journal, JournalError, whole_lines},
};

/// One line per episode.
pub const EPISODES: &str = "episodes.jsonl";
/// Everything needed to repeat the run.
pub const RUN: &str = "run.json";
/// The scripts and calibrations that the run was made from.
pub const SCRIPTS: &str = "scripts.zip";
/// One line per attempt at an episode of an unfinished run, if its policy is outside of softvt.
pub const ATTEMPTS: &str = "attempts.jsonl";
/// Results of a finished run.
pub const SUMMARY: &str = "summary.json";

/// Folders with files of single episodes.
pub(super) const EPISODE_FOLDERS: [&str; 5] =
    ["actions", "trace", "video", "mcap", softvtbench_files::FOLDER];

/// Error of using a run folder.
#[allow(missing_docs, reason = "the messages describe the variants")]
#[derive(Debug, thiserror::Error)]
pub enum RunFolderError {
    /// `found` is a file of that run.
    #[error("{dir} already holds a run ({found}): resume it, or give another output folder")]
    Occupied { dir: String, found: &'static str },
    /// `found` is a file that no run has written.
    #[error("{dir} is not empty and holds no run (it contains {found}); give a new output folder")]
    Foreign { dir: String, found: String },
    #[error("another softvt process is using {dir}; wait for it to finish, or stop it")]
    Busy { dir: String },
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{path} is not a valid run file: {source}")]
    Manifest { path: String, source: serde_json::Error },
    #[error("{dir} holds an experiment, not a run of a suite; its rows are in {dir}/rows.jsonl")]
    Experiment { dir: String },
    #[error("{path} was written by softvt {version} in another format: read it with that version")]
    OtherVersion { path: String, version: String },
    #[error(
        "{path} belongs to another run: {what}; resume it with its original arguments, or select another output folder"
    )]
    OtherRun { path: String, what: String },
    /// `line` counts from 1.
    #[error("{path}:{line}: {source}")]
    BadLine { path: String, line: usize, source: LineError },
    #[error("{path}:{line}: {episode} occurs twice (first in line {first}): remove one of the lines")]
    DuplicateEpisode { path: String, line: usize, first: usize, episode: EpisodeIndex },
    #[error(
        "{path}:{line}: {episode} is not of the run that {RUN} describes; one of the two files was changed, or is of another run"
    )]
    ForeignEpisode { path: String, line: usize, episode: EpisodeIndex },
}

/// The folder of a run in progress, locked against other processes.
#[derive(Debug)]
pub struct RunFolder {
    dir: PathBuf,
    episodes: Journal,
}

impl RunFolder {
    /// Checks that `dir` holds no run.
    ///
    /// # Errors
    /// The folder holds a run.
    pub fn check_vacant(dir: &Path) -> Result<(), RunFolderError> {
        match [RUN, EPISODES, SUMMARY].into_iter().find(|name| dir.join(name).exists()) {
            Some(found) => Err(RunFolderError::Occupied { dir: dir.display().to_string(), found }),
            None => Ok(()),
        }
    }

    /// Checks that `dir` is new or empty.
    ///
    /// # Errors
    /// The folder holds a run or anything else.
    pub fn check_new(dir: &Path) -> Result<(), RunFolderError> {
        Self::check_vacant(dir)?;
        check_own(dir)
    }

    /// Checks that `dir`, which shall hold the folders of several runs, is new or empty, or holds such folders already.
    ///
    /// # Errors
    /// The folder holds something else.
    pub fn check_parent(dir: &Path) -> Result<(), RunFolderError> {
        let holds_runs = |dir: &Path| subfolders(dir).iter().any(|inner| Self::check_vacant(inner).is_err());
        match holds_runs(dir) || subfolders(dir).iter().any(|inner| holds_runs(inner)) {
            true => Ok(()),
            false => check_own(dir),
        }
    }

    /// Creates `dir` with the manifest of a run and an empty `episodes.jsonl`.
    ///
    /// # Errors
    /// The folder holds a run, or cannot be created or written to.
    pub fn create(dir: &Path, manifest: &RunManifest) -> Result<Self, RunFolderError> {
        files::create_folder(dir)?;
        Self::check_new(dir)?;
        // If two runs start in one folder at the same time, one fails here.
        let episodes = Journal::create(&dir.join(EPISODES)).map_err(of_folder(dir, EPISODES))?;
        manifest.write_or_compare(dir)?;
        Ok(Self { dir: dir.into(), episodes })
    }

    /// Opens the folder of a run, which may be empty or missing, and returns the finished episodes. A last line
    /// truncated by a crash is removed.
    ///
    /// # Errors
    /// Another process is using the folder, it is of another run, a line is not an episode of the run,
    /// or the system refuses.
    pub fn resume(dir: &Path, manifest: &RunManifest) -> Result<(Self, Vec<EpisodeRecord>), RunFolderError> {
        files::create_folder(dir)?;
        let path = dir.join(EPISODES);
        if !path.exists() {
            check_own(dir)?;
        }
        let (mut episodes, bytes) = Journal::resume(&path).map_err(of_folder(dir, EPISODES))?;
        // Without a manifest, the run of the episodes is not known.
        if !bytes.is_empty() {
            RunManifest::read(dir)?;
        }
        manifest.write_or_compare(dir)?;
        let records = parse(&bytes, &path, manifest)?;
        episodes.keep_whole_lines(&bytes)?;
        Ok((Self { dir: dir.into(), episodes }, records))
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.dir
    }

    /// Appends and syncs the record of an episode whose other files are written. A crash leaves at
    /// most one truncated line.
    ///
    /// # Errors
    /// The line cannot be written.
    pub fn append(&mut self, record: &EpisodeRecord) -> Result<(), RunFolderError> {
        Ok(self.episodes.append(&write_line(&self.dir.join(EPISODES), record)?)?)
    }

    /// Rewrites the lines in the order of `records`, which must be all of them.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_in_order(&mut self, records: &[EpisodeRecord]) -> Result<(), RunFolderError> {
        Ok(self.episodes.replace(&episode_lines(&self.dir.join(EPISODES), records)?)?)
    }

    /// Removes the files of a run without episodes, and the folder if it is empty then.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn discard(self) -> Result<(), RunFolderError> {
        for name in [RUN, SCRIPTS, EPISODES] {
            files::remove_if_present(&self.dir.join(name))?;
        }
        for name in EPISODE_FOLDERS {
            match fs::remove_dir_all(self.dir.join(name)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(FileError::io("remove", &self.dir.join(name))(error).into());
                }
                _ => {}
            }
        }
        // Fails if the folder holds other files, which must stay.
        let _ = fs::remove_dir(&self.dir);
        Ok(())
    }
}

fn subfolders(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).into_iter().flatten().filter_map(Result::ok);
    entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect()
}

/// Checks that a folder without a run is new or empty, so that a run never mixes its files with others. Hidden files
/// do not count: systems and editors leave them anywhere.
fn check_own(dir: &Path) -> Result<(), RunFolderError> {
    let Ok(entries) = fs::read_dir(dir) else { return Ok(()) };
    let names = entries.filter_map(Result::ok).map(|entry| entry.file_name().to_string_lossy().into_owned());
    match names.filter(|name| !name.starts_with('.')).min() {
        None => Ok(()),
        Some(found) => Err(RunFolderError::Foreign { dir: dir.display().to_string(), found }),
    }
}

/// Names the folder in errors of its journal `found`, for `map_err`.
pub fn of_folder(dir: &Path, found: &'static str) -> impl FnOnce(JournalError) -> RunFolderError + use<> {
    let dir = dir.display().to_string();
    move |error| match error {
        JournalError::Exists => RunFolderError::Occupied { dir, found },
        JournalError::Busy => RunFolderError::Busy { dir },
        JournalError::File(error) => error.into(),
    }
}

/// The content of the file `path`, an `episodes.jsonl`.
pub(super) fn episode_lines(path: &Path, records: &[EpisodeRecord]) -> Result<String, FileError> {
    records.iter().map(|record| write_line(path, record)).collect()
}

/// Reads the episodes of the folder of a run. A last line truncated by a crash is skipped.
///
/// # Errors
/// The file cannot be read, or another line is not an episode of the run.
pub fn read_episodes(dir: &Path, manifest: &RunManifest) -> Result<Vec<EpisodeRecord>, RunFolderError> {
    let path = dir.join(EPISODES);
    parse(&fs::read(&path).map_err(FileError::io("read", &path))?, &path, manifest)
}

/// True if the last line of the episodes was truncated by a crash.
pub(super) fn is_truncated(dir: &Path) -> bool {
    fs::read(dir.join(EPISODES)).is_ok_and(|bytes| bytes.last().is_some_and(|byte| *byte != b'\n'))
}

/// The records in the lines of a run. Each episode may occur once, since another line would count twice.
fn parse(bytes: &[u8], path: &Path, manifest: &RunManifest) -> Result<Vec<EpisodeRecord>, RunFolderError> {
    let mut lines: BTreeMap<EpisodeIndex, usize> = BTreeMap::new();
    let record = |(line, text): (usize, &[u8])| {
        let path = path.display().to_string();
        let record = match read_line(text) {
            Ok(record) => record,
            Err(LineError::NoDigest) => {
                return Err(RunFolderError::OtherVersion { path, version: manifest.softvt.clone() });
            }
            Err(source) => return Err(RunFolderError::BadLine { path, line, source }),
        };
        let episode = record.header.id.index();
        if !manifest.has_record(&record) {
            return Err(RunFolderError::ForeignEpisode { path, line, episode });
        }
        match lines.insert(episode, line) {
            Some(first) => Err(RunFolderError::DuplicateEpisode { path, line, first, episode }),
            None => Ok(record),
        }
    };
    whole_lines(bytes).map(record).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{sample_manifest, sample_record};

    /// A run of four episodes of a task.
    fn manifest() -> RunManifest {
        RunManifest { episodes: 4, ..sample_manifest() }
    }

    fn read(dir: &Path) -> Result<Vec<EpisodeRecord>, RunFolderError> {
        read_episodes(dir, &manifest())
    }

    fn episode(index: u32) -> EpisodeRecord {
        let mut record = sample_record();
        record.header.id.episode = index;
        record
    }

    fn indices(dir: &Path) -> Vec<u32> {
        read(dir).unwrap().iter().map(|r| r.header.id.episode).collect()
    }

    #[test]
    fn lines_are_sorted_at_the_end_of_a_run() {
        let root = tempfile::tempdir().unwrap();
        let dir = root.path().join("deep/run");
        let mut folder = RunFolder::create(&dir, &manifest()).unwrap();
        [2, 0, 1].into_iter().for_each(|i| folder.append(&episode(i)).unwrap());
        assert_eq!(indices(&dir), [2, 0, 1]);
        folder.write_in_order(&[episode(0), episode(1), episode(2)]).unwrap();
        assert_eq!(indices(&dir), [0, 1, 2]);
        assert_eq!(read(&dir).unwrap()[1], episode(1));
    }

    #[test]
    fn a_run_is_resumed_after_its_last_complete_line() {
        let root = tempfile::tempdir().unwrap();
        let mut folder = RunFolder::create(root.path(), &manifest()).unwrap();
        (0..2).for_each(|i| folder.append(&episode(i)).unwrap());
        assert!(
            RunFolder::resume(root.path(), &manifest()).is_err_and(|e| e.to_string().contains("is using"))
        );
        drop(folder);
        let path = root.path().join(EPISODES);
        let whole = fs::read_to_string(&path).unwrap();
        fs::write(&path, format!("{whole}{}", &whole[..40])).unwrap();
        let (mut folder, done) = RunFolder::resume(root.path(), &manifest()).unwrap();
        assert_eq!(done, [episode(0), episode(1)]);
        folder.append(&episode(2)).unwrap();
        assert_eq!(indices(root.path()), [0, 1, 2]);
        let (_, none) = RunFolder::resume(&root.path().join("new"), &manifest()).unwrap();
        assert!(none.is_empty());
    }

    #[test]
    fn a_folder_with_a_run_is_refused_and_not_modified() {
        let root = tempfile::tempdir().unwrap();
        let mut folder = RunFolder::create(root.path(), &manifest()).unwrap();
        folder.append(&episode(0)).unwrap();
        let error = RunFolder::create(root.path(), &manifest()).unwrap_err().to_string();
        assert!(
            error.contains("already holds a run (run.json)") && error.contains("another output folder"),
            "{error}"
        );
        assert_eq!(indices(root.path()), [0]);
    }

    #[test]
    fn the_error_names_a_folder_that_cannot_be_created() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("file");
        fs::write(&file, "x").unwrap();
        let error = RunFolder::create(&file.join("run"), &manifest()).unwrap_err().to_string();
        assert!(error.starts_with("cannot create the folder") && error.contains("file/run"), "{error}");
    }

    #[test]
    fn a_truncated_last_line_is_skipped_and_an_invalid_line_is_an_error() {
        let root = tempfile::tempdir().unwrap();
        let mut folder = RunFolder::create(root.path(), &manifest()).unwrap();
        (0..2).for_each(|i| folder.append(&episode(i)).unwrap());
        let path = root.path().join(EPISODES);
        let whole = fs::read_to_string(&path).unwrap();
        for cut in [1, 2, whole.len() / 4] {
            fs::write(&path, &whole[..whole.len() - cut]).unwrap();
            assert_eq!(indices(root.path()), [0], "{cut} bytes lost");
        }
        fs::write(&path, format!("{{\"suite\":\n{whole}")).unwrap();
        let error = read(root.path()).unwrap_err().to_string();
        assert!(error.contains("episodes.jsonl:1: not an episode record"), "{error}");
    }
}
