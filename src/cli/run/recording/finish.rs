//! What is about a whole data set: its manifest, its card, and what is said at the end.

use std::{collections::BTreeMap, path::Path};

use crate::{
    benchmark::Task,
    cli::{
        error::CliError,
        output::print,
        run::{
            demo_selection::rejected,
            recording::{RecordingConfig, SuiteRecording, failure},
        },
    },
    dataset::{
        card::{Card, TaskCount, rejection_counts},
        demonstration_writer::frame_rate,
        layout::{MANIFEST, PARTS},
        manifest::{self, ManifestEntry},
    },
};

/// Writes manifest and card, and says what there is.
///
/// # Errors
/// Nothing was kept, or a file cannot be written.
pub(crate) fn finish(
    output: &RecordingConfig,
    sessions: &[SuiteRecording],
    root: &Path,
) -> Result<(), CliError> {
    let (mut entries, mut tasks) = (Vec::new(), Vec::new());
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |meta| meta.len());
    for session in sessions {
        for task in &session.tasks {
            let place = session.place(task.id);
            let new =
                session.kept(task.id).into_iter().enumerate().map(|(k, r)| ManifestEntry::new(&place, k, r));
            let new: Vec<ManifestEntry> = new.collect();
            let videos = new.iter().flat_map(|entry| entry.video_files.values());
            let video_bytes = videos.map(|file| size(&root.join(file))).sum();
            tasks.push(TaskCount { hdf5_bytes: size(&place.hdf5()), video_bytes, ..count(session, task) });
            entries.extend(new);
        }
    }
    if entries.is_empty() {
        return Err(nothing_kept(&tasks, root));
    }
    manifest::write(root, &entries).map_err(failure)?;
    let _ = std::fs::remove_dir(root.join(PARTS));
    let card = Card {
        softvt: env!("CARGO_PKG_VERSION").to_owned(),
        fps: frame_rate(),
        has_images: output.pictures,
        has_privileged: output.privileged,
        imported: sessions.first().map(|session| session.batch.imported.clone()).unwrap_or_default(),
        tasks,
    };
    card.write(root).map_err(failure)?;
    for task in &card.tasks {
        print(&format!(
            "{} task {}: {} demonstrations of {} attempts, {} steps, {:.1} MB; not kept: {}\n",
            task.suite,
            task.task,
            task.demos,
            task.attempts,
            task.samples,
            (task.hdf5_bytes + task.video_bytes) as f64 / 1e6,
            rejection_counts(&task.rejected)
        ));
    }
    print(&format!("{}\n", root.join(MANIFEST).display()));
    Ok(())
}

fn nothing_kept(tasks: &[TaskCount], root: &Path) -> CliError {
    let told =
        |task: &TaskCount| format!("{} task {}: {}", task.suite, task.task, rejection_counts(&task.rejected));
    let told: Vec<String> = tasks.iter().map(told).collect();
    CliError::input(format!(
        "no demonstration was kept: {}; all attempts are in {}/attempts",
        told.join("; "),
        root.display()
    ))
}

/// How a task went; nothing of its files.
pub(crate) fn count(session: &SuiteRecording, task: &Task) -> TaskCount {
    let kept = session.kept(task.id);
    let mut rejects = BTreeMap::new();
    let of_task = || session.records.iter().filter(|r| r.identity.task == task.id);
    for reason in of_task().filter_map(rejected) {
        *rejects.entry(reason).or_insert(0) += 1;
    }
    TaskCount {
        suite: session.suite.clone(),
        task: task.id,
        prompt: task.prompt.clone(),
        asset: of_task().next().map_or(String::new(), |r| r.identity.asset.clone()),
        demos: kept.len(),
        samples: kept.iter().map(|r| r.stats.steps as usize).sum(),
        attempts: of_task().count(),
        rejected: rejects,
        hdf5_bytes: 0,
        video_bytes: 0,
    }
}
