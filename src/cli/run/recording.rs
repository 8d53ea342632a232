//! Recording of datasets: attempts at demonstrations, of which the good ones are kept.
//!
//! Attempts are numbered. The dataset depends only on their numbers and outcomes, not on the order in which they
//! finish. All files of an attempt are complete before its line is in `attempts/<suite>/episodes.jsonl`, and the file
//! of a task is merged from them, so an interrupted recording can be continued.

use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::{
    benchmark::CONTROL_HZ,
    cli::{
        error::CliError,
        output::{eprint_notice, print},
        run::{
            run_manifest,
            suite_recording::{RecordingArgs, SuiteRecording, kept},
        },
    },
    dataset::{
        card::{Card, TaskCount, rejection_counts},
        layout::{self, DATASET, MANIFEST, PARTS, RECORDING},
        manifest::{self, ManifestEntry},
    },
    evaluation::record::EpisodeRecord,
    files,
    text::counted,
};

/// Records a dataset. `request` describes it in `recording.json`; `prepare` returns its prepared suites.
///
/// # Errors
/// The folder contains something else, an attempt or a file fails, or too few attempts are good.
pub(crate) fn record_all<'a>(
    args: &'a RecordingArgs,
    request: &Value,
    prepare: impl FnOnce() -> Result<Vec<SuiteRecording<'a>>, CliError>,
) -> Result<(), CliError> {
    let root = &args.out;
    if check_folder(root, args.resume, request)? {
        eprint_notice(format!("{} is already complete", root.display()));
        return Ok(());
    }
    let missing = files::missing_folders(root);
    // Preparation takes long, so a folder that cannot be written to is reported first.
    let prepared = files::create_writable_folder(root).map_err(CliError::from).and_then(|()| prepare());
    let suites = prepared.inspect_err(|_| files::remove_empty_folders(&missing))?;
    files::replace(&root.join(RECORDING), format!("{request:#}\n"))?;
    let mut records = Vec::new();
    for suite in &suites {
        records.push(suite.record().inspect_err(|_| remove_if_empty(root, &missing))?);
    }
    write_summary(args, &suites, &records)
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
    let stored: Value = serde_json::from_str(&files::read_text(&path)?)
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

/// Writes manifest and card, and prints what the dataset contains.
///
/// # Errors
/// No demonstration was kept, or a file cannot be written.
fn write_summary(
    args: &RecordingArgs,
    suites: &[SuiteRecording],
    records: &[Vec<EpisodeRecord>],
) -> Result<(), CliError> {
    let root = &args.out;
    let (mut entries, mut tasks) = (Vec::new(), Vec::new());
    let size = |path: &Path| fs::metadata(path).map_or(0, |metadata| metadata.len());
    for (suite, records) in suites.iter().zip(records) {
        for task in &suite.tasks {
            let paths = suite.paths(task.id);
            let kept = kept(records, task.id).into_iter().enumerate();
            let new: Vec<ManifestEntry> =
                kept.map(|(demo, record)| ManifestEntry::new(&paths, demo, record)).collect();
            let videos = new.iter().flat_map(|entry| entry.video_files.values());
            let video_bytes = videos.map(|file| size(&root.join(file))).sum();
            tasks.push(TaskCount {
                hdf5_bytes: size(&paths.hdf5()),
                video_bytes,
                ..suite.count(task, records)
            });
            entries.extend(new);
        }
    }
    if entries.is_empty() {
        let reasons: Vec<String> = tasks
            .iter()
            .map(|task| format!("{} task {}: {}", task.suite, task.task, rejection_counts(&task.rejected)))
            .collect();
        return Err(CliError::input(format!(
            "no demonstration was kept: {}; all attempts are in {}/attempts",
            reasons.join("; "),
            root.display()
        )));
    }
    manifest::write(root, &entries)?;
    let _ = fs::remove_dir(root.join(PARTS));
    let card = Card {
        softvt: env!("CARGO_PKG_VERSION").to_owned(),
        fps: CONTROL_HZ,
        has_images: args.has_hdf5_images(),
        has_privileged: !args.no_privileged,
        imported: suites.first().map(|suite| suite.run.imported.clone()).unwrap_or_default(),
        tasks,
    };
    card.write(root)?;
    for task in &card.tasks {
        print(&format!(
            "{} task {}: {} from {}, {}, {:.1} MB; not kept: {}\n",
            task.suite,
            task.task,
            counted(task.demos, "demonstration"),
            counted(task.attempts, "attempt"),
            counted(task.samples, "step"),
            (task.hdf5_bytes + task.video_bytes) as f64 / 1e6,
            rejection_counts(&task.rejected)
        ));
    }
    print(&format!("{}\n", root.join(MANIFEST).display()));
    Ok(())
}
