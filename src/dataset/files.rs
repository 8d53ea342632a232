//! Files that appear whole or not at all.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};

use super::DatasetError;

/// Makes a folder and those above it.
///
/// # Errors
/// The system refuses.
pub fn make_folder(dir: &Path) -> Result<(), DatasetError> {
    fs::create_dir_all(dir).map_err(DatasetError::io("make the folder", dir))
}

/// Makes a folder and those above it, in which files can be made.
///
/// # Errors
/// The system refuses.
pub fn make_writable(dir: &Path) -> Result<(), DatasetError> {
    make_folder(dir)?;
    let probe = dir.join(".softvt");
    let made = File::create(&probe).and_then(|_| fs::remove_file(&probe));
    made.map_err(DatasetError::io("write into", dir))
}

/// A folder and those above it that are not there yet, the deepest first.
pub fn missing(dir: &Path) -> Vec<PathBuf> {
    let named = dir.ancestors().filter(|path| !path.as_os_str().is_empty());
    named.take_while(|path| fs::symlink_metadata(path).is_err()).map(Path::to_owned).collect()
}

/// Removes folders, the deepest first, as long as they are empty.
pub fn take_back(folders: &[PathBuf]) {
    let _ = folders.iter().try_for_each(fs::remove_dir);
}

/// Where a file is made before it gets its name.
pub fn aside(path: &Path) -> PathBuf {
    let mut name = OsString::from(path.file_name().unwrap_or_default());
    name.push(".part");
    path.with_file_name(name)
}

/// Gives a file that was made aside its name; it is on disk then.
///
/// # Errors
/// The system refuses.
pub fn settle(aside: &Path, path: &Path) -> Result<(), DatasetError> {
    File::open(aside).and_then(|file| file.sync_all()).map_err(DatasetError::io("sync", aside))?;
    fs::rename(aside, path).map_err(DatasetError::io("rename", path))?;
    // The new name itself must outlast a power cut; a system that cannot sync folders keeps it in order some other way.
    let _ = path.parent().map(File::open).transpose().map(|folder| folder.map(|folder| folder.sync_all()));
    Ok(())
}

/// Writes a whole file.
///
/// # Errors
/// The system refuses; what was written aside is taken away.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), DatasetError> {
    make_folder(path.parent().unwrap_or(path))?;
    let aside = aside(path);
    let written = File::create(&aside).and_then(|mut file| file.write_all(bytes));
    if let Err(source) = written {
        let _ = fs::remove_file(&aside);
        return Err(DatasetError::io("write", path)(source));
    }
    settle(&aside, path)
}

/// Removes a file that may not be there.
///
/// # Errors
/// The system refuses.
pub fn remove(path: &Path) -> Result<(), DatasetError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(DatasetError::io("remove", path)(error)),
        _ => Ok(()),
    }
}

/// The text of a file.
///
/// # Errors
/// It is not there, cannot be read, or is no text.
pub fn read_text(path: &Path) -> Result<String, DatasetError> {
    fs::read_to_string(path).map_err(DatasetError::io("read", path))
}
