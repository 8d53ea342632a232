//! The folder of a data set in the making.

use std::{
    io::ErrorKind,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::{
    cli::{
        error::CliError,
        run::{recording::failure, run_manifest::difference},
    },
    dataset::layout::{self, DATASET, PARTS, RECORDING},
};

/// Whether the folder holds this very recording, finished.
///
/// # Errors
/// It holds another, or something else, or this one and it is not to go on.
pub(crate) fn check(root: &Path, resume: bool, recording: &Value) -> Result<bool, CliError> {
    let dir = root.display();
    let path = root.join(RECORDING);
    if root.exists() && !root.is_dir() {
        return Err(CliError::input(format!("--out {dir}: it is no folder; give a new folder")));
    }
    if !path.is_file() {
        let found = std::fs::read_dir(root).ok().and_then(|mut entries| entries.next()?.ok());
        return match found {
            None => Ok(false),
            Some(entry) => Err(CliError::input(format!(
                "--out {dir}: it holds {} and no recording of softvt; nothing was written; give a new folder",
                entry.file_name().to_string_lossy()
            ))),
        };
    }
    let known: Value = serde_json::from_str(&crate::files::read_text(&path).map_err(failure)?)
        .map_err(|e| CliError::input(format!("{}: no recording of softvt: {e}", path.display())))?;
    let made_by = |recording: &Value| match recording.get("imported") {
        Some(_) => "softvt dataset import",
        None => "softvt record",
    };
    if made_by(&known) != made_by(recording) {
        return Err(CliError::input(format!(
            "--out {dir}: it holds what {} made; give a new folder",
            made_by(&known)
        )));
    }
    if let Some(what) = difference(&known, recording) {
        return Err(CliError::input(format!(
            "--out {dir}: it holds another recording ({what}); give a new folder, or what it was started with"
        )));
    }
    if !resume && !root.join(DATASET).is_file() {
        return Err(CliError::input(format!(
            "--out {dir}: it holds a recording that was broken off; go on with it by --resume, or give a new folder"
        )));
    }
    Ok(root.join(DATASET).is_file())
}

/// Takes back what was written of a recording without any attempt, and the folders that were `missing` before it.
pub(crate) fn take_back(root: &Path, missing: &[PathBuf]) {
    let attempts = root.join(layout::ATTEMPTS);
    // Folders with something in them stay, and then it is known what they are of.
    let _ = std::fs::remove_dir(&attempts);
    let gone = std::fs::symlink_metadata(&attempts).is_err_and(|e| e.kind() == ErrorKind::NotFound);
    if gone {
        let _ = std::fs::remove_dir_all(root.join(PARTS));
        let _ = std::fs::remove_file(root.join(RECORDING));
        crate::files::remove_empty_folders(missing);
    }
}
