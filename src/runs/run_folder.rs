//! The folder of a run: `run.json`, `episodes.jsonl`, `summary.json` and the files of the episodes.
//!
//! The line of an episode is written and synced when the episode ends, after its other files: an episode with a line is
//! complete. Each line ends with its digest ([`record_line`](super::record_line)). At the end of a run the lines are
//! sorted by episode, so that the file's bytes depend neither on the number of threads nor on interruptions.

use std::{
    collections::BTreeMap,
    fmt::Display,
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

/// A file of a run is not valid, not of that run, or cannot be read or written. The text names the file and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct RunFolderError(String);

impl RunFolderError {
    pub(crate) fn new(message: impl ToString) -> Self {
        Self(message.to_string())
    }

    /// `line` counts from 1.
    pub(crate) fn in_line(path: &Path, line: usize, what: impl Display) -> Self {
        Self(format!("{}:{line}: {what}", path.display()))
    }

    fn occupied(dir: &Path, found: &str) -> Self {
        let dir = dir.display();
        Self(format!("{dir} already holds a run ({found}): resume it, or give another output folder"))
    }
}

impl From<FileError> for RunFolderError {
    fn from(error: FileError) -> Self {
        Self::new(error)
    }
}

/// The folder of a run in progress, locked against other processes.
#[derive(Debug)]
pub struct RunFolder {
    dir: PathBuf,
    episodes: Journal,
}

impl RunFolder {
    /// Checks that `dir` holds no run.
    pub fn check_vacant(dir: &Path) -> Result<(), RunFolderError> {
        match [RUN, EPISODES, SUMMARY].into_iter().find(|name| dir.join(name).exists()) {
            Some(found) => Err(RunFolderError::occupied(dir, found)),
            None => Ok(()),
        }
    }

    /// Checks that `dir` is new or empty, so that a run never mixes its files with others. Hidden files do not count:
    /// systems and editors leave them anywhere.
    ///
    /// # Errors
    /// The folder holds a run or anything else.
    pub fn check_new(dir: &Path) -> Result<(), RunFolderError> {
        Self::check_vacant(dir)?;
        let Ok(entries) = fs::read_dir(dir) else { return Ok(()) };
        let names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
        match names.filter(|name| !name.starts_with('.')).min() {
            None => Ok(()),
            Some(found) => Err(RunFolderError(format!(
                "{} is not empty and holds no run (it contains {found}); give a new output folder",
                dir.display()
            ))),
        }
    }

    /// Checks that `dir`, which shall hold the folders of several runs, is new or empty, or holds such folders already.
    pub fn check_parent(dir: &Path) -> Result<(), RunFolderError> {
        let holds_runs = |dir: &Path| subfolders(dir).iter().any(|inner| Self::check_vacant(inner).is_err());
        match holds_runs(dir) || subfolders(dir).iter().any(|inner| holds_runs(inner)) {
            true => Ok(()),
            false => Self::check_new(dir),
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
            Self::check_new(dir)?;
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

    pub fn path(&self) -> &Path {
        &self.dir
    }

    /// Appends and syncs the record of an episode whose other files are written. A crash leaves at
    /// most one truncated line.
    pub fn append(&mut self, record: &EpisodeRecord) -> Result<(), RunFolderError> {
        Ok(self.episodes.append(&write_line(&self.dir.join(EPISODES), record)?)?)
    }

    /// Rewrites the lines in the order of `records`, which must be all of them.
    pub fn write_in_order(&mut self, records: &[EpisodeRecord]) -> Result<(), RunFolderError> {
        Ok(self.episodes.replace(&episode_lines(&self.dir.join(EPISODES), records)?)?)
    }

    /// Removes the files of a run without episodes, and the folder if it is empty then.
    pub fn discard(self) -> Result<(), RunFolderError> {
        for name in [RUN, SCRIPTS, EPISODES] {
            files::remove_if_present(&self.dir.join(name))?;
        }
        for name in EPISODE_FOLDERS {
            remove_folder_if_present(&self.dir.join(name))?;
        }
        // Fails if the folder holds other files, which must stay.
        let _ = fs::remove_dir(&self.dir);
        Ok(())
    }
}

/// Removes a folder with all that it contains.
pub fn remove_folder_if_present(dir: &Path) -> Result<(), FileError> {
    match fs::remove_dir_all(dir) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(FileError::io("remove", dir)(error)),
        _ => Ok(()),
    }
}

fn subfolders(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).into_iter().flatten().filter_map(Result::ok);
    entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect()
}

/// Names the folder in errors of its journal `found`, for `map_err`.
pub fn of_folder(dir: &Path, found: &'static str) -> impl FnOnce(JournalError) -> RunFolderError + use<> {
    let dir = dir.to_owned();
    move |error| match error {
        JournalError::Exists => RunFolderError::occupied(&dir, found),
        JournalError::Busy => RunFolderError(format!(
            "another softvt process is using {}; wait for it to finish, or stop it",
            dir.display()
        )),
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
        let bad = |what: &dyn Display| Err(RunFolderError::in_line(path, line, what));
        let record = match read_line(text) {
            Ok(record) => record,
            Err(LineError::NoDigest) => return Err(RunManifest::other_version(path, &manifest.softvt)),
            Err(error) => return bad(&error),
        };
        let episode = record.header.id.index();
        if !manifest.has_record(&record) {
            return bad(&format_args!(
                "{episode} is not of the run that {RUN} describes; one of the two files was changed, or is of another run"
            ));
        }
        match lines.insert(episode, line) {
            Some(first) => {
                bad(&format_args!("{episode} occurs twice (first in line {first}): remove one of the lines"))
            }
            None => Ok(record),
        }
    };
    whole_lines(bytes).map(record).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{sample_manifest, sample_record};

    /// A run of a task with four episodes.
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
