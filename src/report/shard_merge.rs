//! Merges the shards of a run into the folder that a single run would have written.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use super::{
    run_folder::{EPISODES, RUN, RunFolderError, SUMMARY, io_error, line},
    softvtbench_files,
    stored_run::{StoredRun, StoredRunError, load},
};
use crate::{
    evaluation::{record::EpisodeRecord, summary::SuiteSummary, thresholds::ThresholdFile},
    files::{self, FileError},
};

/// Folders with files of single episodes.
const EPISODE_FOLDERS: [&str; 4] = ["actions", "trace", "video", softvtbench_files::FOLDER];

/// Error of merging shards.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    #[error(transparent)]
    Runs(#[from] StoredRunError),
    #[error(transparent)]
    Folder(#[from] RunFolderError),
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{0}")]
    NotMergeable(String),
}

/// Merges the shards in `dirs` into the new folder `out`, and returns the summary of each merged run, sorted by suite.
///
/// # Errors
/// A shard is missing, unfinished, given twice or of another run; `out` exists; a file cannot be read or written.
pub fn merge(out: &Path, dirs: &[PathBuf]) -> Result<Vec<SuiteSummary>, MergeError> {
    if out.exists() {
        return Err(MergeError::NotMergeable(format!("{} already exists; give a new folder", out.display())));
    }
    let mut suites: BTreeMap<String, Vec<StoredRun>> = BTreeMap::new();
    let mut in_subfolders = false;
    for dir in dirs {
        for run in load(dir)? {
            in_subfolders |= run.dir != *dir;
            suites.entry(run.text("suite").to_owned()).or_default().push(run);
        }
    }
    if suites.len() > 1 && !in_subfolders {
        let names: Vec<&str> = suites.keys().map(String::as_str).collect();
        return Err(MergeError::NotMergeable(format!(
            "these are shards of several suites ({}): merge each suite separately",
            names.join(", ")
        )));
    }
    let parts: Result<Vec<_>, MergeError> = suites.values().map(|runs| compose(runs)).collect();
    // Everything is checked before anything is written.
    let temp = files::temp_path(out);
    let mut summaries = Vec::new();
    for (runs, run) in suites.values().zip(parts?) {
        let folder = match (in_subfolders, runs[0].dir.file_name()) {
            (true, Some(name)) => temp.join(name),
            _ => temp.clone(),
        };
        summaries.push(write(&folder, runs, &run)?);
    }
    fs::rename(&temp, out).map_err(io_error("rename", &temp))?;
    Ok(summaries)
}

/// A run composed of shards.
struct MergedRun {
    manifest: Value,
    /// Ordered by task and episode.
    records: Vec<EpisodeRecord>,
}

/// Checks that the shards are complete and belong together.
fn compose(runs: &[StoredRun]) -> Result<MergedRun, MergeError> {
    let error =
        |run: &StoredRun, what: String| MergeError::NotMergeable(format!("{}: {what}", run.dir.display()));
    let manifest_without_shard = |run: &StoredRun| {
        let mut manifest = run.manifest.clone();
        manifest.as_object_mut().map(|map| map.shift_remove("shard"));
        manifest
    };
    let manifest = manifest_without_shard(&runs[0]);
    let mut seen: BTreeMap<(usize, u32), &Path> = BTreeMap::new();
    for run in runs {
        if run.manifest["shard"].is_null() {
            return Err(error(run, "it is not a shard: it was run without --shard".to_owned()));
        }
        if manifest_without_shard(run) != manifest {
            return Err(error(run, format!("it is a shard of another run than {}", runs[0].dir.display())));
        }
        for record in &run.records {
            let id = (record.identity.task, record.identity.episode);
            if let Some(other) = seen.insert(id, &run.dir) {
                let what = format!("task {} episode {} is also in {}", id.0, id.1, other.display());
                return Err(error(run, what));
            }
        }
    }
    let tasks: Vec<usize> = manifest["tasks"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|n| Some(n.as_u64()? as usize))
        .collect();
    let episodes = manifest["episodes"].as_u64().unwrap_or(0) as u32;
    let expected: BTreeSet<(usize, u32)> =
        tasks.iter().flat_map(|task| (0..episodes).map(|e| (*task, e))).collect();
    let missing: Vec<_> = expected.iter().filter(|id| !seen.contains_key(id)).collect();
    if let Some((task, episode)) = missing.first() {
        return Err(MergeError::NotMergeable(format!(
            "suite {}: {} of {} episodes are missing, the first of which is task {task} episode {episode}: a shard is not given or not finished (--resume)",
            runs[0].text("suite"),
            missing.len(),
            expected.len()
        )));
    }
    let mut records: Vec<EpisodeRecord> = runs.iter().flat_map(|run| run.records.clone()).collect();
    records.sort_by_key(|r| (r.identity.task, r.identity.episode));
    Ok(MergedRun { manifest, records })
}

fn write(
    folder: &Path,
    runs: &[StoredRun],
    MergedRun { manifest, records }: &MergedRun,
) -> Result<SuiteSummary, MergeError> {
    files::create_folder(folder)?;
    for run in runs {
        for name in EPISODE_FOLDERS {
            copy_tree(&run.dir.join(name), &folder.join(name))?;
        }
    }
    let lines: Result<String, RunFolderError> =
        records.iter().map(|r| line(r, &folder.join(EPISODES))).collect();
    files::replace(&folder.join(EPISODES), lines?)?;
    files::write_json(&folder.join(RUN), manifest)?;
    let path = runs[0].dir.join(softvtbench_files::FOLDER).join(softvtbench_files::THRESHOLDS_JSON);
    let text = fs::read_to_string(&path).map_err(io_error("read", &path))?;
    let thresholds = ThresholdFile::parse(&text, &path.display().to_string())
        .map_err(|error| MergeError::NotMergeable(error.to_string()))?;
    softvtbench_files::write_scores(folder, records, &thresholds)?;
    // The records of a rigid twin carry its own suite name.
    let suite = records.first().map_or(runs[0].suite(), |record| &record.identity.suite);
    let summary = SuiteSummary::of(suite, runs[0].text("policy"), records);
    files::write_json(&folder.join(SUMMARY), &summary)?;
    Ok(summary)
}

/// Copies the task folders in a folder. Files next to them describe the whole run and are written again.
fn copy_tree(from: &Path, to: &Path) -> Result<(), RunFolderError> {
    let Ok(entries) = fs::read_dir(from) else { return Ok(()) };
    let mut folders: Vec<PathBuf> =
        entries.filter_map(Result::ok).map(|e| e.path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    for folder in folders {
        let inner = to.join(folder.file_name().unwrap_or_default());
        files::create_folder(&inner)?;
        copy_tree(&folder, &inner)?;
        let files = fs::read_dir(&folder).map_err(io_error("read", &folder))?;
        for file in files.filter_map(Result::ok).map(|e| e.path()).filter(|p| p.is_file()) {
            let target = inner.join(file.file_name().unwrap_or_default());
            fs::copy(&file, &target).map_err(io_error("copy to", &target))?;
        }
    }
    Ok(())
}
