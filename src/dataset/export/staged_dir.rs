//! [`StagedDir`]: a folder that appears complete or not at all.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
};

use crate::DatasetError;
use softvt_common::files::{self, FileError};

/// Marker file of an export in progress or interrupted; locked by the writing process.
const MARKER_FILE: &str = ".softvt-export";

/// A folder under construction next to its final path.
pub(super) struct StagedDir {
    temp: PathBuf,
    out: PathBuf,
    /// Parent folders that were created, deepest first.
    created_parents: Vec<PathBuf>,
    // Closing the file releases the lock.
    _marker: File,
}

impl StagedDir {
    /// Creates a temporary folder next to `out`. The remains of an interrupted export are removed first.
    pub(super) fn create(out: &Path) -> Result<Self, DatasetError> {
        require_empty(out)?;
        // A link to an empty folder cannot be replaced by a folder, but its target can.
        let out = fs::canonicalize(out).unwrap_or_else(|_| out.to_path_buf());
        if out.file_name().is_none() {
            return Err(refused(&out, "it has no name"));
        }
        let temp = files::temp_path(&out);
        if fs::symlink_metadata(&temp).is_ok() {
            remove_remains(&temp)?;
        }
        let parent = temp.parent().unwrap_or(&temp);
        let created_parents = files::missing_folders(parent);
        let make = || -> Result<File, FileError> {
            files::create_folder(parent)?;
            fs::create_dir(&temp).map_err(FileError::io("create the folder", &temp))?;
            let path = temp.join(MARKER_FILE);
            File::create(&path).map_err(FileError::io("write", &path))
        };
        let marker = make().inspect_err(|_| files::remove_empty_folders(&created_parents))?;
        // A file system without locks has no protection from a second export to the same folder, which is rare.
        let _ = marker.try_lock();
        Ok(Self { temp, out, created_parents, _marker: marker })
    }

    pub(super) fn path(&self) -> &Path {
        &self.temp
    }

    pub(super) fn commit(self) -> Result<(), DatasetError> {
        files::rename(&self.temp, &self.out).inspect_err(|_| self.abort())?;
        Ok(files::remove_if_present(&self.out.join(MARKER_FILE))?)
    }

    /// Removes the folder and the parents created for it.
    pub(super) fn abort(&self) {
        let _ = fs::remove_dir_all(&self.temp);
        files::remove_empty_folders(&self.created_parents);
    }
}

fn refused(path: &Path, what: &str) -> DatasetError {
    let what = format!("{what}; nothing was written; give a new folder");
    DatasetError::Output { out: path.display().to_string(), what }
}

/// Refuses `out` unless it is missing or an empty folder.
fn require_empty(out: &Path) -> Result<(), DatasetError> {
    match fs::read_dir(out) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(error) if error.kind() == std::io::ErrorKind::NotADirectory => {
            Err(refused(out, "it is not a folder"))
        }
        Err(error) => Err(FileError::io("read", out)(error).into()),
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(Err(error)) => Err(FileError::io("read", out)(error).into()),
            Some(Ok(entry)) => {
                Err(refused(out, &format!("it holds {}", entry.file_name().to_string_lossy())))
            }
        },
    }
}

fn remove_remains(temp: &Path) -> Result<(), DatasetError> {
    let Ok(marker) = File::open(temp.join(MARKER_FILE)) else {
        return Err(refused(temp, "it is in the way and not left by an interrupted export"));
    };
    if let Err(TryLockError::WouldBlock) = marker.try_lock() {
        return Err(refused(temp, "another export is writing it"));
    }
    Ok(fs::remove_dir_all(temp).map_err(FileError::io("remove", temp))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_appears_when_it_is_complete() {
        let home = tempfile::tempdir().unwrap();
        let out = home.path().join("new/out");
        StagedDir::create(&out).unwrap().abort();
        assert_eq!(names(home.path()), [""; 0]);
        let staged = StagedDir::create(&out).unwrap();
        fs::write(staged.path().join("x"), "x").unwrap();
        assert!(!out.exists());
        staged.commit().unwrap();
        assert_eq!(names(&out), ["x"]);
        assert_eq!(names(&home.path().join("new")), ["out"]);
    }

    #[test]
    fn remains_of_an_export_are_replaced_and_other_files_kept() {
        let home = tempfile::tempdir().unwrap();
        let (out, temp) = (home.path().join("out"), home.path().join("out.part"));
        fs::create_dir(&temp).unwrap();
        fs::write(temp.join(MARKER_FILE), "").unwrap();
        fs::write(temp.join("torn"), "torn").unwrap();
        let staged = StagedDir::create(&out).unwrap();
        assert_eq!(names(&temp), [MARKER_FILE]);
        let second = StagedDir::create(&out).err().unwrap().to_string();
        assert!(second.contains("another export is writing it"), "{second}");
        staged.abort();
        drop(staged);
        assert_eq!(names(home.path()), [""; 0]);
        fs::create_dir(&temp).unwrap();
        fs::write(temp.join("mine"), "mine").unwrap();
        let refused = StagedDir::create(&out).err().unwrap().to_string();
        assert!(refused.contains("out.part: it is in the way"), "{refused}");
        assert_eq!(names(&temp), ["mine"]);
    }
}
