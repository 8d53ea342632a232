//! Manifest, card and printed summary of a complete dataset.

use std::{collections::BTreeMap, fs, path::Path};

use super::{RecordingConfig, SuiteRecording, dataset_error};
use crate::{
    benchmark::{CONTROL_HZ, Task},
    cli::{error::CliError, output::print, run::demo_selection::rejection},
    dataset::{
        card::{Card, TaskCount, rejection_counts},
        layout::{MANIFEST, PARTS},
        manifest::{self, ManifestEntry},
    },
    text::counted,
};

/// Writes manifest and card, and prints what the dataset contains.
///
/// # Errors
/// No demonstration was kept, or a file cannot be written.
pub(super) fn write(
    config: &RecordingConfig,
    suites: &[SuiteRecording],
    root: &Path,
) -> Result<(), CliError> {
    let (mut entries, mut tasks) = (Vec::new(), Vec::new());
    let size = |path: &Path| fs::metadata(path).map_or(0, |metadata| metadata.len());
    for suite in suites {
        for task in &suite.tasks {
            let paths = suite.paths(task.id);
            let kept = suite.kept(task.id).into_iter().enumerate();
            let new: Vec<ManifestEntry> =
                kept.map(|(demo, record)| ManifestEntry::new(&paths, demo, record)).collect();
            let videos = new.iter().flat_map(|entry| entry.video_files.values());
            let video_bytes = videos.map(|file| size(&root.join(file))).sum();
            tasks.push(TaskCount { hdf5_bytes: size(&paths.hdf5()), video_bytes, ..count(suite, task) });
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
    manifest::write(root, &entries).map_err(dataset_error)?;
    let _ = fs::remove_dir(root.join(PARTS));
    let card = Card {
        softvt: env!("CARGO_PKG_VERSION").to_owned(),
        fps: CONTROL_HZ,
        has_images: config.images_in_hdf5,
        has_privileged: config.with_privileged,
        imported: suites.first().map(|suite| suite.run.imported.clone()).unwrap_or_default(),
        tasks,
    };
    card.write(root).map_err(dataset_error)?;
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

/// Counts of a task, without the sizes of its files.
pub(super) fn count(suite: &SuiteRecording, task: &Task) -> TaskCount {
    let kept = suite.kept(task.id);
    let attempts = || suite.records.iter().filter(|record| record.header.id.task == task.id);
    let mut rejected = BTreeMap::new();
    for reason in attempts().filter_map(rejection) {
        *rejected.entry(reason).or_insert(0) += 1;
    }
    TaskCount {
        suite: suite.folder_name.clone(),
        task: task.id,
        prompt: task.prompt.clone(),
        asset: attempts().next().map_or(String::new(), |record| record.header.asset.clone()),
        demos: kept.len(),
        samples: kept.iter().map(|record| record.stats.steps as usize).sum(),
        attempts: attempts().count(),
        rejected,
        hdf5_bytes: 0,
        video_bytes: 0,
    }
}
