//! A file of lines that are complete as soon as they are written: what is finished of a long run, for its continuation.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Read, Write},
    path::{Path, PathBuf},
};

use super::files::{self, FileError};

/// A file of lines in progress, locked against other processes.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
}

#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    #[error("the file exists already")]
    Exists,
    #[error("another process is using it")]
    Busy,
    #[error(transparent)]
    File(#[from] FileError),
}

impl Journal {
    /// Creates an empty file.
    ///
    /// # Errors
    /// The file exists, also if another process creates it at the same time; or the system refuses.
    pub fn create(path: &Path) -> Result<Self, JournalError> {
        let file =
            OpenOptions::new().append(true).create_new(true).open(path).map_err(|source| {
                match source.kind() {
                    io::ErrorKind::AlreadyExists => JournalError::Exists,
                    _ => FileError::io("create", path)(source).into(),
                }
            })?;
        lock(&file)?;
        Ok(Self { path: path.into(), file })
    }

    /// Opens a file, which may be missing, and returns its content. A last line truncated by a crash is removed by
    /// [`keep_whole_lines`](Self::keep_whole_lines).
    ///
    /// # Errors
    /// Another process is using the file, or the system refuses.
    pub fn resume(path: &Path) -> Result<(Self, Vec<u8>), JournalError> {
        let file = OpenOptions::new().read(true).append(true).create(true).open(path);
        let mut file = file.map_err(FileError::io("open", path))?;
        lock(&file)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(FileError::io("read", path))?;
        Ok((Self { path: path.into(), file }, bytes))
    }

    /// Shortens the file, whose content is `bytes`, to its whole lines.
    pub fn keep_whole_lines(&mut self, bytes: &[u8]) -> Result<(), FileError> {
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        match whole < bytes.len() {
            true => self.file.set_len(whole as u64).map_err(FileError::io("shorten", &self.path)),
            false => Ok(()),
        }
    }

    /// Appends and syncs a text of whole lines. A crash leaves at most one truncated line.
    pub fn append(&mut self, lines: &str) -> Result<(), FileError> {
        self.file.write_all(lines.as_bytes()).map_err(FileError::io("write to", &self.path))?;
        self.file.sync_data().map_err(FileError::io("sync", &self.path))
    }

    /// Replaces the content, if it is another one. Nothing can be appended afterwards.
    pub fn replace(&mut self, lines: &str) -> Result<(), FileError> {
        if fs::read(&self.path).map_err(FileError::io("read", &self.path))? != lines.as_bytes() {
            files::replace(&self.path, lines)?;
        }
        Ok(())
    }
}

/// The whole lines of a journal that are not empty, each with its number from 1. Text after the last
/// line break was truncated.
pub fn whole_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let end = bytes.iter().rposition(|byte| *byte == b'\n').unwrap_or(0);
    let lines = bytes[..end].split(|byte| *byte == b'\n').enumerate();
    lines.map(|(i, line)| (i + 1, line)).filter(|(_, line)| !line.is_empty())
}

/// Locks the file until it is closed; the system closes it when the process dies.
fn lock(file: &File) -> Result<(), JournalError> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(JournalError::Busy),
        // The file system does not support locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}
