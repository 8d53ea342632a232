//! The folder in which a run or a recording was made. Its paths are relative to it, so that it can be replayed from any
//! folder.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::{
    error::RunError,
    observer::Observer,
    replay::{demos_of, recorded_manifest},
};
use softvt_common::files::FileError;
use softvt_dataset::{TaskFile, layout::ATTEMPTS};
use softvt_runs::{
    manifest::RunManifest,
    run_folder::{RUN, SCRIPTS},
    stored_run::StoredRun,
};

/// Makes the folder of a run the working folder, unless its script is in the present one. Returns the path
/// of the run from the working folder. A run that has its scripts needs no folder, unless a file of
/// `--vary` replaced its variation.
///
/// # Errors
/// The script is in none of the folders.
pub fn enter_for_run(run: &StoredRun, observer: &dyn Observer) -> Result<PathBuf, RunError> {
    if run.dir.join(SCRIPTS).is_file() && run.manifest.vary.is_none() {
        return Ok(run.dir.clone());
    }
    enter(&run.dir, &run.manifest.script, run.manifest.folder.as_deref(), observer)
}

/// Makes the folder of a recording the working folder, unless its script is in the present one. Returns the path of the
/// dataset from the working folder.
///
/// # Errors
/// The dataset cannot be read, or the script is in none of the folders.
pub fn enter_for_dataset(path: &Path, observer: &dyn Observer) -> Result<PathBuf, RunError> {
    let Some(demo) = demos_of(path)?.into_iter().next() else { return Ok(path.to_owned()) };
    let manifest = recorded_manifest(&TaskFile::open(&demo.file)?)?;
    let folder = recording_folder(&demo.file)?;
    enter(path, &manifest.script, folder.as_deref(), observer)
}

/// The folder in which the recording of an HDF5 file was made, as its attempts state it.
fn recording_folder(file: &Path) -> Result<Option<String>, RunError> {
    let file = std::path::absolute(file).map_err(FileError::io("locate", file))?;
    let attempts = file.ancestors().map(|folder| folder.join(ATTEMPTS)).find(|folder| folder.is_dir());
    let suites = attempts.and_then(|attempts| fs::read_dir(attempts).ok());
    let runs = suites.into_iter().flatten().filter_map(Result::ok).map(|suite| suite.path());
    let Some(first) = runs.filter(|run| run.join(RUN).is_file()).min() else { return Ok(None) };
    Ok(RunManifest::read(&first)?.folder)
}

/// Makes the folder that has `script` the working folder: the present one, `stored`, or one above `path`. Returns
/// `path` from there.
fn enter(
    path: &Path,
    script: &str,
    stored: Option<&str>,
    observer: &dyn Observer,
) -> Result<PathBuf, RunError> {
    if Path::new(script).is_file() {
        return Ok(path.to_owned());
    }
    let absolute = std::path::absolute(path).map_err(FileError::io("locate", path))?;
    let folders = stored.map(Path::new).into_iter().chain(absolute.ancestors().skip(1));
    if let Some(folder) = folders.into_iter().find(|folder| folder.join(script).is_file()) {
        std::env::set_current_dir(folder).map_err(FileError::io("enter the folder", folder))?;
        observer.notice(&format!("using {script} in {}", folder.display()));
        return Ok(absolute);
    }
    if softvt_script::embedded(script).is_some() {
        return Ok(path.to_owned());
    }
    let made_in = stored.map_or(String::new(), |folder| format!(" or in {folder}, where it was made"));
    Err(RunError::input(format_args!(
        "{}: its script {script} is not in the working folder{made_in}; change to the folder that contains it",
        path.display()
    )))
}
