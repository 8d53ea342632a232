//! Files that appear complete or not at all, and the folders they are written to.
//!
//! A file is written to a sibling with the suffix `.part`, synced, and renamed. The name of the sibling is fixed, so
//! that the next attempt replaces what a killed process left; `tempfile` would leave one file with a random name per
//! kill, and gives its files mode 0600.

use std::{
    ffi::OsString,
    fs::{self, File, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
};

use serde::Serialize;

/// Error of a file operation, with the file it was about.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    #[error("cannot {action} {path}: {source}")]
    Io { action: &'static str, path: String, source: io::Error },
    #[error("cannot write {path} as JSON: {source}")]
    Json { path: String, source: serde_json::Error },
}

impl FileError {
    /// Converts the `io::Error` of `action` on `path`, for `map_err`.
    pub fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.display().to_string();
        move |source| Self::Io { action, path, source }
    }

    /// Converts the error of serialising the content of `path`, for `map_err`.
    pub(crate) fn json(path: &Path) -> impl FnOnce(serde_json::Error) -> Self + use<> {
        let path = path.display().to_string();
        move |source| Self::Json { path, source }
    }
}

/// Creates a folder and its missing parents.
///
/// # Errors
/// A path component is not a folder, or the system refuses.
pub fn create_folder(dir: &Path) -> Result<(), FileError> {
    fs::create_dir_all(dir).map_err(FileError::io("create the folder", dir))
}

/// Creates the folder of a file and its missing parents.
pub fn create_parent(path: &Path) -> Result<(), FileError> {
    create_folder(path.parent().unwrap_or(path))
}

/// Creates a folder and its missing parents, and checks that files can be created in it.
pub fn create_writable_folder(dir: &Path) -> Result<(), FileError> {
    create_folder(dir)?;
    let probe = dir.join(".softvt");
    try_create(&probe).map_err(FileError::io("write to", dir))
}

/// Checks that [`replace`] can create a file at `path`, or the first missing folder on the way.
///
/// # Errors
/// Its folder is read-only or no folder.
pub fn check_creatable(path: &Path) -> Result<(), FileError> {
    let probe = temp_path(&missing_folders(path).pop().unwrap_or_else(|| path.to_owned()));
    try_create(&probe).map_err(FileError::io("write", path))
}

/// Creates a file and removes it again. One that exists stays, also one of another process that does the same.
fn try_create(probe: &Path) -> io::Result<()> {
    match OpenOptions::new().write(true).create_new(true).open(probe) {
        Ok(_) => fs::remove_file(probe),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
        Err(error) => Err(error),
    }
}

/// The folders that [`create_folder`] would create for `dir`, deepest first.
pub fn missing_folders(dir: &Path) -> Vec<PathBuf> {
    let named = dir.ancestors().filter(|path| !path.as_os_str().is_empty());
    named.take_while(|path| fs::symlink_metadata(path).is_err()).map(Path::to_owned).collect()
}

/// Removes `folders` in order, up to the first that is not empty.
pub fn remove_empty_folders(folders: &[PathBuf]) {
    let _ = folders.iter().try_for_each(fs::remove_dir);
}

/// Path at which a file or folder is written before [`persist`] gives it its name.
pub fn temp_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(path.file_name().unwrap_or_default());
    name.push(".part");
    path.with_file_name(name)
}

/// Syncs a complete file at `temp` and renames it to `path`. Both are durable afterwards.
///
/// # Errors
/// The system refuses to sync or rename.
pub fn persist(temp: &Path, path: &Path) -> Result<(), FileError> {
    File::open(temp).and_then(|file| file.sync_all()).map_err(FileError::io("sync", temp))?;
    rename(temp, path)
}

/// Renames a file or folder. The new name is durable afterwards.
pub fn rename(from: &Path, to: &Path) -> Result<(), FileError> {
    fs::rename(from, to).map_err(FileError::io("replace", to))?;
    // The new name must survive a power failure as well. Systems that cannot sync folders have other means.
    let _ = to.parent().map(File::open).transpose().map(|folder| folder.map(|folder| folder.sync_all()));
    Ok(())
}

/// Replaces `path` by `content`, creating missing folders. Readers see the old or the new file, never a part of it.
///
/// # Errors
/// The path is a folder, a device or a pipe; or the system refuses, and the temporary file is removed.
pub fn replace(path: &Path, content: impl AsRef<[u8]>) -> Result<(), FileError> {
    create_parent(path)?;
    // Devices and pipes would cease to be what they are.
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        let source = io::Error::other("it is not a regular file");
        return Err(FileError::io("replace", path)(source));
    }
    let temp = temp_path(path);
    // Created, not truncated: if the name is a symbolic link, its target must not be overwritten.
    remove_if_present(&temp)?;
    let file = OpenOptions::new().write(true).create_new(true).open(&temp);
    file.and_then(|mut file| file.write_all(content.as_ref()))
        .inspect_err(|_| drop(fs::remove_file(&temp)))
        .map_err(FileError::io("write", path))?;
    persist(&temp, path).inspect_err(|_| drop(fs::remove_file(&temp)))
}

/// Replaces `path` by `value` as indented JSON; see [`replace`].
///
/// # Errors
/// The value cannot be represented in JSON, or the file cannot be written.
pub fn write_json<T: Serialize + ?Sized>(path: &Path, value: &T) -> Result<(), FileError> {
    let text = serde_json::to_string_pretty(value).map_err(FileError::json(path))?;
    replace(path, text + "\n")
}

/// One line of JSON per item, for a file at `path`.
///
/// # Errors
/// An item cannot be represented in JSON.
pub fn json_lines<T: Serialize>(
    path: &Path,
    items: impl IntoIterator<Item = T>,
) -> Result<String, FileError> {
    let line = |item| Ok(serde_json::to_string(&item).map_err(FileError::json(path))? + "\n");
    items.into_iter().map(line).collect()
}

/// Replaces `path` by one line of JSON per item; see [`replace`].
pub fn write_json_lines<T: Serialize>(
    path: &Path,
    items: impl IntoIterator<Item = T>,
) -> Result<(), FileError> {
    replace(path, json_lines(path, items)?)
}

/// Removes a file if it exists.
///
/// # Errors
/// The file exists and the system refuses.
pub fn remove_if_present(path: &Path) -> Result<(), FileError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(FileError::io("remove", path)(error)),
        _ => Ok(()),
    }
}

/// Reads a UTF-8 file.
///
/// # Errors
/// The file is missing, unreadable or not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    fs::read_to_string(path).map_err(FileError::io("read", path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_replaced_and_no_temporary_file_remains() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("summary.json");
        write_json(&path, &vec![1, 2]).unwrap();
        write_json(&path, &vec![3]).unwrap();
        assert_eq!(fs::read_to_string(path).unwrap(), "[\n  3\n]\n");
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 1);
    }
}
