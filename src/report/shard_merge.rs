//! The shards of a run put together: the folder that one unbroken run would have left.

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

/// Folders that hold files of single episodes.
const PER_EPISODE: [&str; 4] = ["actions", "trace", "video", softvtbench_files::FOLDER];

/// Why shards cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// A run cannot be read.
    #[error(transparent)]
    Runs(#[from] StoredRunError),
    /// A file cannot be written.
    #[error(transparent)]
    Folder(#[from] RunFolderError),
    #[error(transparent)]
    File(#[from] FileError),
    /// They do not belong together.
    #[error("{0}")]
    Unfit(String),
}

/// Merges the shards in `dirs` into the new folder `out`; the summaries of the runs that they make up, by suite.
///
/// # Errors
/// A shard is missing, unfinished, twice there or of another run; `out` exists; a file cannot be read or written.
pub fn merge(out: &Path, dirs: &[PathBuf]) -> Result<Vec<SuiteSummary>, MergeError> {
    if out.exists() {
        return Err(MergeError::Unfit(format!("{} exists already; name a new folder", out.display())));
    }
    let mut suites: BTreeMap<String, Vec<StoredRun>> = BTreeMap::new();
    let mut deep = false;
    for dir in dirs {
        for run in load(dir)? {
            deep |= run.dir != *dir;
            suites.entry(run.text("suite").to_owned()).or_default().push(run);
        }
    }
    if suites.len() > 1 && !deep {
        let names: Vec<&str> = suites.keys().map(String::as_str).collect();
        return Err(MergeError::Unfit(format!(
            "these are shards of several suites ({}): merge each alone",
            names.join(", ")
        )));
    }
    let parts: Result<Vec<_>, MergeError> = suites.values().map(|runs| whole(runs)).collect();
    // All is checked before anything is written; it gets its name when it is whole.
    let aside = out.with_file_name(format!("{}.part", out.file_name().unwrap_or_default().to_string_lossy()));
    let mut summaries = Vec::new();
    for (runs, (info, records)) in suites.values().zip(parts?) {
        let folder = match (deep, runs[0].dir.file_name()) {
            (true, Some(name)) => aside.join(name),
            _ => aside.clone(),
        };
        summaries.push(write(&folder, runs, &info, &records)?);
    }
    fs::rename(&aside, out).map_err(io_error("rename", &aside))?;
    Ok(summaries)
}

/// What the whole run was and its episodes, in order.
fn whole(runs: &[StoredRun]) -> Result<(Value, Vec<EpisodeRecord>), MergeError> {
    let unfit = |run: &StoredRun, what: String| MergeError::Unfit(format!("{}: {what}", run.dir.display()));
    let without = |run: &StoredRun| {
        let mut info = run.info.clone();
        info.as_object_mut().map(|map| map.shift_remove("shard"));
        info
    };
    let info = without(&runs[0]);
    let mut seen: BTreeMap<(usize, u32), &Path> = BTreeMap::new();
    for run in runs {
        if run.info["shard"].is_null() {
            return Err(unfit(run, "it is no shard: it was run without --shard".to_owned()));
        }
        if without(run) != info {
            return Err(unfit(run, format!("it is a shard of another run than {}", runs[0].dir.display())));
        }
        for record in &run.records {
            let id = (record.identity.task, record.identity.episode);
            if let Some(other) = seen.insert(id, &run.dir) {
                let what = format!("task {} episode {} is in {} too", id.0, id.1, other.display());
                return Err(unfit(run, what));
            }
        }
    }
    let tasks: Vec<usize> =
        info["tasks"].as_array().into_iter().flatten().filter_map(|n| Some(n.as_u64()? as usize)).collect();
    let episodes = info["episodes"].as_u64().unwrap_or(0) as u32;
    let wanted: BTreeSet<(usize, u32)> =
        tasks.iter().flat_map(|task| (0..episodes).map(|e| (*task, e))).collect();
    let missing: Vec<_> = wanted.iter().filter(|id| !seen.contains_key(id)).collect();
    if let Some((task, episode)) = missing.first() {
        return Err(MergeError::Unfit(format!(
            "suite {}: {} of {} episodes are in none of the shards, task {task} episode {episode} first: a shard is not given or not finished (--resume)",
            runs[0].text("suite"),
            missing.len(),
            wanted.len()
        )));
    }
    let mut records: Vec<EpisodeRecord> = runs.iter().flat_map(|run| run.records.clone()).collect();
    records.sort_by_key(|r| (r.identity.task, r.identity.episode));
    Ok((info, records))
}

fn write(
    folder: &Path,
    runs: &[StoredRun],
    info: &Value,
    records: &[EpisodeRecord],
) -> Result<SuiteSummary, MergeError> {
    files::create_folder(folder)?;
    for run in runs {
        for name in PER_EPISODE {
            copy(&run.dir.join(name), &folder.join(name))?;
        }
    }
    let lines: Result<String, RunFolderError> =
        records.iter().map(|r| line(r, &folder.join(EPISODES))).collect();
    files::replace(&folder.join(EPISODES), lines?)?;
    files::write_json(&folder.join(RUN), info)?;
    let path = runs[0].dir.join(softvtbench_files::FOLDER).join(softvtbench_files::THRESHOLDS_JSON);
    let text = fs::read_to_string(&path).map_err(io_error("read", &path))?;
    let thresholds = ThresholdFile::parse(&text, &path.display().to_string())
        .map_err(|error| MergeError::Unfit(error.to_string()))?;
    softvtbench_files::write_scores(folder, records, &thresholds)?;
    // That of a twin is not the name of its suite.
    let suite = records.first().map_or(runs[0].suite(), |record| &record.identity.suite);
    let summary = SuiteSummary::of(suite, runs[0].text("policy"), records);
    files::write_json(&folder.join(SUMMARY), &summary)?;
    Ok(summary)
}

/// Copies the folders of tasks in a folder; files beside them are of the whole run and are made anew.
fn copy(from: &Path, to: &Path) -> Result<(), RunFolderError> {
    let Ok(entries) = fs::read_dir(from) else { return Ok(()) };
    let mut folders: Vec<PathBuf> =
        entries.filter_map(Result::ok).map(|e| e.path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    for folder in folders {
        let inner = to.join(folder.file_name().unwrap_or_default());
        files::create_folder(&inner)?;
        copy(&folder, &inner)?;
        let files = fs::read_dir(&folder).map_err(io_error("read", &folder))?;
        for file in files.filter_map(Result::ok).map(|e| e.path()).filter(|p| p.is_file()) {
            let goal = inner.join(file.file_name().unwrap_or_default());
            fs::copy(&file, &goal).map_err(io_error("copy to", &goal))?;
        }
    }
    Ok(())
}
