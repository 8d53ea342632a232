//! Recording of datasets: attempts at demonstrations, of which the good ones are kept.
//!
//! Attempts are numbered. The dataset depends only on their numbers and outcomes, not on the order in which they
//! finish. All files of an attempt are complete before its line is in `attempts/<suite>/episodes.jsonl`, and the file
//! of a task is merged from them, so an interrupted recording can be continued.

mod suite_recording;
mod summary;

use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::{
    cli::{
        args::{ImageStorage, RecordingArgs, ScriptArgs, TraceDetail},
        error::CliError,
        output::notice,
        run::{
            config::{RunConfig, thread_count},
            policy::PolicyConfig,
            run_manifest,
        },
    },
    dataset::{
        DatasetError,
        layout::{self, DATASET, PARTS, RECORDING},
    },
    files,
};

pub(crate) use suite_recording::{AttemptPlan, SuiteRecording};

/// Configuration of a recording.
#[derive(Clone, Debug)]
pub(crate) struct RecordingConfig {
    /// Script, tasks, seed, threads, settings and output folder.
    pub run: RunConfig,
    /// True if images go into the HDF5 files too.
    pub images_in_hdf5: bool,
    /// True if the ground-truth streams are recorded.
    pub with_privileged: bool,
}

impl RecordingConfig {
    /// The recording that the arguments ask for, under the expert.
    ///
    /// # Errors
    /// A value that is not valid.
    pub(crate) fn new(
        script: &ScriptArgs,
        recording: &RecordingArgs,
        tasks: &[String],
    ) -> Result<Self, CliError> {
        let run = RunConfig::of_script(script)?.with_out(Some(recording.out.clone()));
        Ok(Self {
            run: RunConfig {
                tasks: tasks.to_vec(),
                threads: thread_count(recording.threads),
                resume: recording.resume,
                // The contact streams of a demonstration come from the trace.
                trace: Some(TraceDetail::State),
                ..run
            },
            images_in_hdf5: recording.images == ImageStorage::Hdf5,
            with_privileged: !recording.no_privileged,
        })
    }

    /// The same recording under another policy.
    pub(crate) fn with_policy(self, policy: PolicyConfig) -> Self {
        Self { run: RunConfig { policy, ..self.run }, ..self }
    }

    /// Folder of the dataset.
    fn root(&self) -> PathBuf {
        self.run.out.clone().unwrap_or_default()
    }
}

/// Records a dataset. `request` describes it in `recording.json`; `prepare` returns its prepared suites.
///
/// # Errors
/// The folder contains something else, an attempt or a file fails, or too few attempts are good.
pub(crate) fn record_all<'a>(
    config: &'a RecordingConfig,
    request: &Value,
    prepare: impl FnOnce() -> Result<Vec<SuiteRecording<'a>>, CliError>,
) -> Result<(), CliError> {
    let root = config.root();
    if check_folder(&root, config.run.resume, request)? {
        notice(format!("{} is already complete", root.display()));
        return Ok(());
    }
    let missing = files::missing_folders(&root);
    // Preparation takes long, so a folder that cannot be written to is reported first.
    let prepared = files::create_writable_folder(&root).map_err(dataset_error).and_then(|()| prepare());
    let mut suites = prepared.inspect_err(|_| files::remove_empty_folders(&missing))?;
    let text = format!("{request:#}\n");
    files::replace(&root.join(RECORDING), text.as_bytes()).map_err(dataset_error)?;
    for suite in &mut suites {
        suite.record().inspect_err(|_| remove_if_empty(&root, &missing))?;
    }
    summary::write(config, &suites, &root)
}

/// Checks that a dataset can be recorded into a folder. Returns true if it contains this very recording, complete.
///
/// # Errors
/// The folder contains another recording, something else, or this recording incomplete without `resume`.
fn check_folder(root: &Path, resume: bool, request: &Value) -> Result<bool, CliError> {
    let path = root.join(RECORDING);
    let refuse = |message: String| Err(CliError::input(format!("--out {}: {message}", root.display())));
    if root.exists() && !root.is_dir() {
        return refuse("not a folder; select a new folder".to_owned());
    }
    if !path.is_file() {
        let found = fs::read_dir(root).ok().and_then(|mut entries| entries.next()?.ok());
        return match found {
            None => Ok(false),
            Some(entry) => refuse(format!(
                "the folder contains {} but no softvt recording; nothing was written; select a new folder",
                entry.file_name().to_string_lossy()
            )),
        };
    }
    let stored: Value = serde_json::from_str(&files::read_text(&path).map_err(dataset_error)?)
        .map_err(|e| CliError::input(format!("{} is not a softvt recording: {e}", path.display())))?;
    let command = |request: &Value| match request.get("imported") {
        Some(_) => "softvt dataset import",
        None => "softvt record",
    };
    if command(&stored) != command(request) {
        return refuse(format!("the folder contains a dataset of {}; select a new folder", command(&stored)));
    }
    if let Some(difference) = run_manifest::difference(&stored, request) {
        return refuse(format!(
            "the folder contains another recording ({difference}); select a new folder, or use its original arguments"
        ));
    }
    let is_complete = root.join(DATASET).is_file();
    if !resume && !is_complete {
        return refuse(
            "the folder contains an interrupted recording; continue it with --resume, or select a new folder"
                .to_owned(),
        );
    }
    Ok(is_complete)
}

/// Removes a recording that has no attempts, and the folders that were `missing` before it.
fn remove_if_empty(root: &Path, missing: &[PathBuf]) {
    let attempts = root.join(layout::ATTEMPTS);
    // Fails for a folder that is not empty. Then recording.json must stay, since it says what the attempts are of.
    let _ = fs::remove_dir(&attempts);
    let is_gone = fs::symlink_metadata(&attempts).is_err_and(|error| error.kind() == ErrorKind::NotFound);
    if is_gone {
        let _ = fs::remove_dir_all(root.join(PARTS));
        let _ = fs::remove_file(root.join(RECORDING));
        files::remove_empty_folders(missing);
    }
}

fn dataset_error(error: impl Into<DatasetError>) -> CliError {
    match error.into() {
        DatasetError::Interrupted => CliError::interrupted("interrupted"),
        other => CliError::input(other),
    }
}
