//! Merges the shards of a run into the folder that a single run would have written.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use super::{
    actions,
    manifest::RunManifest,
    record::EpisodeRecord,
    run_folder::{
        EPISODE_FOLDERS, EPISODES, RUN, RunFolderError, SCRIPTS, SUMMARY, episode_lines,
        remove_folder_if_present,
    },
    softvtbench_files,
    stored_run::{StoredRun, load},
    summary::SuiteSummary,
};
use softvt_common::{
    episode_id::EpisodeIndex,
    files::{self, FileError},
};
use softvt_evaluation::thresholds::ThresholdFile;

/// Merges the shards in `dirs` into the new folder `out`, and returns the summary of each merged run, sorted by suite.
///
/// # Errors
/// A shard is missing, unfinished, given twice or of another run; `out` exists; a file cannot be read or written.
pub fn merge(out: &Path, dirs: &[PathBuf]) -> Result<Vec<SuiteSummary>, RunFolderError> {
    if out.exists() {
        let out = out.display();
        return Err(RunFolderError::new(format_args!("{out} already exists; give a new folder")));
    }
    let mut suites: BTreeMap<String, Vec<StoredRun>> = BTreeMap::new();
    let mut in_subfolders = false;
    for dir in dirs {
        for run in load(dir)? {
            in_subfolders |= run.dir != *dir;
            suites.entry(run.manifest.suite.clone()).or_default().push(run);
        }
    }
    if suites.len() > 1 && !in_subfolders {
        let names: Vec<&str> = suites.keys().map(String::as_str).collect();
        return Err(RunFolderError::new(format_args!(
            "these are shards of several suites ({}): merge each suite separately",
            names.join(", ")
        )));
    }
    // Everything is checked before anything is written.
    let merged: Vec<MergedRun> =
        suites.values().map(|shards| MergedRun::new(shards)).collect::<Result<_, _>>()?;
    let temp = files::temp_path(out);
    // An earlier merge that was killed may have left it.
    remove_folder_if_present(&temp)?;
    let write = || {
        let mut summaries = Vec::new();
        for run in &merged {
            let folder = match (in_subfolders, run.shards[0].dir.file_name()) {
                (true, Some(name)) => temp.join(name),
                _ => temp.clone(),
            };
            summaries.push(run.write(&folder)?);
        }
        files::rename(&temp, out)?;
        Ok(summaries)
    };
    // The disk may be full: the space is freed.
    write().inspect_err(|_: &RunFolderError| drop(remove_folder_if_present(&temp)))
}

/// A run composed of shards.
struct MergedRun<'a> {
    shards: &'a [StoredRun],
    manifest: RunManifest,
    /// Ordered by task and episode.
    records: Vec<EpisodeRecord>,
}

impl<'a> MergedRun<'a> {
    /// Checks that the shards are complete and belong together.
    fn new(shards: &'a [StoredRun]) -> Result<Self, RunFolderError> {
        let of_run = &shards[0].manifest;
        let whole = |run: &StoredRun| RunManifest { shard: None, ..run.manifest.identity() };
        let mut seen: BTreeMap<EpisodeIndex, &StoredRun> = BTreeMap::new();
        for run in shards {
            let refuse =
                |what: String| Err(RunFolderError::new(format_args!("{}: {what}", run.dir.display())));
            if run.manifest.shard.is_none() {
                return refuse("it is the run of a whole suite, not a shard".to_owned());
            }
            if whole(run) != whole(&shards[0]) {
                return refuse(format!("it is a shard of another run than {}", shards[0].dir.display()));
            }
            for record in &run.records {
                let episode = record.header.id.index();
                if let Some(other) = seen.insert(episode, run) {
                    return refuse(format!("{episode} is also in {}", other.dir.display()));
                }
                actions::read_checked(&run.dir, record).map_err(|error| {
                    RunFolderError::new(format_args!("{error}; resume that shard to restore it"))
                })?;
            }
        }
        let RunManifest { tasks, episodes, suite, .. } = of_run;
        let of_task = |task: usize| (0..*episodes).map(move |episode| EpisodeIndex { task, episode });
        let mut all = tasks.iter().flat_map(|task| of_task(*task));
        if let Some(first) = all.find(|index| !seen.contains_key(index)) {
            let expected = tasks.len() * *episodes as usize;
            return Err(RunFolderError::new(format_args!(
                "suite {suite}: {} of {expected} episodes are missing, the first of which is {first}: a shard is not given, or not finished and can be resumed",
                expected - seen.len()
            )));
        }
        let mut records: Vec<EpisodeRecord> = shards.iter().flat_map(|run| run.records.clone()).collect();
        records.sort_by_key(|r| r.header.id.index());
        // The shards may have run on several machines. Their scripts are looked for in the folder of the first.
        let manifest = RunManifest { shard: None, ..of_run.clone() };
        Ok(Self { shards, manifest, records })
    }

    /// Writes the files of the run and returns its summary.
    fn write(&self, folder: &Path) -> Result<SuiteSummary, RunFolderError> {
        let Self { shards, manifest, records } = self;
        files::create_folder(folder)?;
        for run in *shards {
            for name in EPISODE_FOLDERS {
                copy_tree(&run.dir.join(name), &folder.join(name))?;
            }
        }
        let lines = folder.join(EPISODES);
        files::replace(&lines, episode_lines(&lines, records)?)?;
        files::write_json(&folder.join(RUN), manifest)?;
        let scripts = shards[0].dir.join(SCRIPTS);
        if scripts.is_file() {
            let target = folder.join(SCRIPTS);
            fs::copy(&scripts, &target).map_err(FileError::io("copy to", &target))?;
        }
        let path = shards[0].dir.join(softvtbench_files::FOLDER).join(softvtbench_files::THRESHOLDS_JSON);
        let thresholds = ThresholdFile::read_released(&path).map_err(RunFolderError::new)?;
        softvtbench_files::write_scores(folder, records, &thresholds)?;
        let suite = manifest.changes().suite_name(&manifest.suite);
        let summary = SuiteSummary::from_records(&suite, &manifest.policy, records);
        files::write_json(&folder.join(SUMMARY), &summary)?;
        Ok(summary)
    }
}

/// Copies the task folders in a folder. Files next to them describe the whole run and are written again.
fn copy_tree(from: &Path, to: &Path) -> Result<(), FileError> {
    let Ok(entries) = fs::read_dir(from) else { return Ok(()) };
    let mut folders: Vec<PathBuf> =
        entries.filter_map(Result::ok).map(|e| e.path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    for folder in folders {
        let inner = to.join(folder.file_name().unwrap_or_default());
        files::create_folder(&inner)?;
        copy_tree(&folder, &inner)?;
        let files = fs::read_dir(&folder).map_err(FileError::io("read", &folder))?;
        for file in files.filter_map(Result::ok).map(|e| e.path()).filter(|p| p.is_file()) {
            let target = inner.join(file.file_name().unwrap_or_default());
            fs::copy(&file, &target).map_err(FileError::io("copy to", &target))?;
        }
    }
    Ok(())
}
