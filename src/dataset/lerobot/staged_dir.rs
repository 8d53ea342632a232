//! A folder that appears whole or not at all.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
};

use crate::{dataset::DatasetError, files};

/// Whoever has it is being written, or was when something broke it off; the writer keeps it locked.
const MARK: &str = ".softvt-export";

/// Where a folder is made before it gets its name.
pub(super) struct StagedDir {
    aside: PathBuf,
    out: PathBuf,
    /// The folders that were made to put it in, the deepest first.
    above: Vec<PathBuf>,
    // The lock goes with it.
    _mark: File,
}

impl StagedDir {
    /// InitialCondition a folder beside `out`; what a broken-off export left there goes.
    ///
    /// # Errors
    /// Something is at `out`, or in the way beside it, or is just being written; or the system refuses.
    pub(super) fn claim(out: &Path) -> Result<Self, DatasetError> {
        free(out)?;
        // A link to an empty folder cannot be replaced by a folder, but what it leads to can.
        let out = fs::canonicalize(out).unwrap_or_else(|_| out.to_path_buf());
        if out.file_name().is_none() {
            return Err(DatasetError::content(&out, "--out", "it has no name; give a new folder"));
        }
        let aside = files::temp_path(&out);
        if fs::symlink_metadata(&aside).is_ok() {
            clear(&aside)?;
        }
        let parent = aside.parent().unwrap_or(&aside);
        let above = files::missing_folders(parent);
        let make = || {
            files::create_folder(parent)?;
            fs::create_dir(&aside).map_err(DatasetError::io("make the folder", &aside))?;
            let path = aside.join(MARK);
            File::create(&path).map_err(DatasetError::io("write", &path))
        };
        let mark = make().inspect_err(|_| files::remove_empty_folders(&above))?;
        // A file system without locks has no protection from a second export to the same folder, which is rare.
        let _ = mark.try_lock();
        Ok(Self { aside, out, above, _mark: mark })
    }

    /// The folder while it is being written.
    pub(super) fn dir(&self) -> &Path {
        &self.aside
    }

    /// Gives the folder its name.
    ///
    /// # Errors
    /// The system refuses; nothing is left then.
    pub(super) fn settle(self) -> Result<(), DatasetError> {
        if let Err(error) = fs::rename(&self.aside, &self.out) {
            self.give_up();
            return Err(DatasetError::io("rename", &self.out)(error));
        }
        files::remove_if_present(&self.out.join(MARK))?;
        // The new name itself must outlast a power cut; a system that cannot sync folders keeps it in order some other way.
        for folder in [Some(self.out.as_path()), self.out.parent()].into_iter().flatten() {
            let _ = File::open(folder).map(|folder| folder.sync_all());
        }
        Ok(())
    }

    /// Takes everything back.
    pub(super) fn give_up(&self) {
        let _ = fs::remove_dir_all(&self.aside);
        files::remove_empty_folders(&self.above);
    }
}

/// Refuses what holds anything.
///
/// # Errors
/// It does, or it is no folder.
pub(super) fn free(out: &Path) -> Result<(), DatasetError> {
    let taken = |what: &str| {
        let told = format!("{what}; nothing was written; give a new folder");
        Err(DatasetError::OutputNotEmpty { out: out.display().to_string(), what: told })
    };
    match fs::read_dir(out) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(error) if error.kind() == std::io::ErrorKind::NotADirectory => taken("it is no folder"),
        Err(error) => Err(DatasetError::io("read", out)(error)),
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(Err(error)) => Err(DatasetError::io("read", out)(error)),
            Some(Ok(entry)) => taken(&format!("it holds {}", entry.file_name().to_string_lossy())),
        },
    }
}

/// Removes what a broken-off export left.
fn clear(aside: &Path) -> Result<(), DatasetError> {
    let in_the_way = |what: &str| {
        Err(DatasetError::OutputNotEmpty {
            out: aside.display().to_string(),
            what: format!("{what}; nothing was written; give another --out"),
        })
    };
    let Ok(mark) = File::open(aside.join(MARK)) else {
        return in_the_way("it is in the way, and no rest of a broken-off export");
    };
    if let Err(TryLockError::WouldBlock) = mark.try_lock() {
        return in_the_way("another export is writing it");
    }
    fs::remove_dir_all(aside).map_err(DatasetError::io("remove", aside))
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
    fn a_folder_has_its_name_when_it_is_whole() {
        let home = tempfile::tempdir().unwrap();
        let out = home.path().join("new/out");
        StagedDir::claim(&out).unwrap().give_up();
        assert_eq!(names(home.path()), [""; 0]);
        let place = StagedDir::claim(&out).unwrap();
        fs::write(place.dir().join("x"), "x").unwrap();
        assert!(!out.exists());
        place.settle().unwrap();
        assert_eq!(names(&out), ["x"]);
        assert_eq!(names(&home.path().join("new")), ["out"]);
    }

    #[test]
    fn what_was_broken_off_is_replaced_and_what_is_not_ours_stays() {
        let home = tempfile::tempdir().unwrap();
        let (out, aside) = (home.path().join("out"), home.path().join("out.part"));
        fs::create_dir(&aside).unwrap();
        fs::write(aside.join(MARK), "").unwrap();
        fs::write(aside.join("torn"), "torn").unwrap();
        let place = StagedDir::claim(&out).unwrap();
        assert_eq!(names(&aside), [MARK]);
        let second = StagedDir::claim(&out).err().unwrap().to_string();
        assert!(second.contains("another export is writing it"), "{second}");
        place.give_up();
        drop(place);
        assert_eq!(names(home.path()), [""; 0]);
        fs::create_dir(&aside).unwrap();
        fs::write(aside.join("mine"), "mine").unwrap();
        let refused = StagedDir::claim(&out).err().unwrap().to_string();
        assert!(refused.contains("out.part: it is in the way"), "{refused}");
        assert_eq!(names(&aside), ["mine"]);
    }

    #[test]
    fn a_folder_with_something_in_it_is_refused_and_an_empty_one_is_taken() {
        let home = tempfile::tempdir().unwrap();
        let out = home.path().join("out");
        fs::create_dir(&out).unwrap();
        StagedDir::claim(&out).unwrap().settle().unwrap();
        fs::write(out.join("mine"), "mine").unwrap();
        let refused = StagedDir::claim(&out).err().unwrap().to_string();
        assert!(refused.contains("it holds mine; nothing was written"), "{refused}");
        let file = StagedDir::claim(&out.join("mine")).err().unwrap().to_string();
        assert!(file.contains("it is no folder"), "{file}");
    }
}
