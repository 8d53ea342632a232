//! [`StoredRun`]: a finished or unfinished run, read from its folder.

use std::{
    cmp::Ordering,
    fs, io,
    path::{Path, PathBuf},
};

use super::{
    manifest::{RunManifest, VERSION},
    record::EpisodeRecord,
    run_folder::{EPISODES, RUN, RunFolderError, SUMMARY, is_truncated, read_episodes},
    summary::MethodMarks,
};
use softvt_common::{episode_id::EpisodeIndex, files::FileError};

#[derive(Clone, Debug)]
pub struct StoredRun {
    pub dir: PathBuf,
    pub manifest: RunManifest,
    /// Records of its episodes, ordered by task and episode.
    pub records: Vec<EpisodeRecord>,
    /// True if the run came to its end.
    pub is_finished: bool,
    /// True if the last line of its episodes was truncated by a crash.
    pub is_truncated: bool,
}

/// Records under the name of another suite. A rigid twin is paired with its soft original by task and episode.
pub fn records_as(records: &[EpisodeRecord], suite: &str) -> Vec<EpisodeRecord> {
    let mut records = records.to_vec();
    records.iter_mut().for_each(|record| suite.clone_into(&mut record.header.id.suite));
    records
}

/// The changes that a run makes to its suite, as tables and plots name them.
#[derive(Clone, Debug, PartialEq)]
pub struct ConditionLabel {
    /// Name of the changed factor, such as `mass`; `several` for more than one.
    pub factor: String,
    /// Its value, if one number is changed.
    pub value: Option<f64>,
    /// All changes, such as `mass=2`.
    pub label: String,
}

impl ConditionLabel {
    /// Order by factor, then by value; changes without a number come last.
    pub fn compare(&self, other: &Self) -> Ordering {
        let value = |change: &Self| change.value.unwrap_or(f64::NAN);
        self.factor
            .cmp(&other.factor)
            .then_with(|| value(self).total_cmp(&value(other)))
            .then_with(|| self.label.cmp(&other.label))
    }
}

impl StoredRun {
    /// Name of the suite in the results, which differs from that in `run.json` for a rigid twin.
    pub fn suite(&self) -> &str {
        self.records.first().map_or(&self.manifest.suite, |record| &record.header.id.suite)
    }

    /// Name of the suite whose initial states the run has: for a rigid twin that of its soft original.
    pub fn original_suite(&self) -> &str {
        self.manifest.twin_of.as_ref().unwrap_or(&self.manifest.suite)
    }

    pub fn is_rigid_twin(&self) -> bool {
        self.manifest.twin_of.is_some() || self.manifest.twin.is_some()
    }

    /// Marks of the policy: knowledge beyond what a robot measures, and repeated actions.
    pub fn marks(&self) -> MethodMarks {
        MethodMarks {
            privileged: self.manifest.is_privileged(),
            replayed: self.manifest.replayed.is_some(),
            force_observed: self.manifest.force_observed,
        }
    }

    pub fn record(&self, index: EpisodeIndex) -> Option<&EpisodeRecord> {
        self.records.iter().find(|record| record.header.id.index() == index)
    }

    /// True if episodes are missing: the run is in progress or was interrupted.
    pub fn is_partial(&self) -> bool {
        !self.is_finished || self.records.len() < self.manifest.requested_episodes()
    }

    /// The changes to the suite; `None` for a suite as it is.
    pub fn condition(&self) -> Option<ConditionLabel> {
        let twin = self.is_rigid_twin().then(|| "rigid twin".to_owned());
        let changes = self.manifest.changes();
        let names: Vec<String> = changes.assignments().into_iter().chain(twin).collect();
        let label = names.join(", ");
        let (factor, value) = match (&names[..], &changes.shifts[..]) {
            ([], _) => return None,
            ([_], [shift]) => (shift.name.as_str(), Some(shift.value)),
            ([single], _) => match single.split_once('=') {
                Some((factor, value)) => (factor, value.parse().ok()),
                None => (single.as_str(), None),
            },
            _ => ("several", None),
        };
        Some(ConditionLabel { factor: factor.to_owned(), value, label })
    }

    /// Settings that the run under a condition and its reference share.
    pub fn condition_group(&self) -> [String; 5] {
        let RunManifest { policy, seed, split, vary, .. } = &self.manifest;
        [
            self.original_suite().to_owned(),
            policy.clone(),
            seed.to_string(),
            split.name().to_owned(),
            vary.clone().unwrap_or_default(),
        ]
    }

    /// Warnings for a reader of the results, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let (dir, RunManifest { softvt, modified, shard, .. }) = (self.dir.display(), &self.manifest);
        if self.is_partial() {
            warnings.push(format!(
                "{dir} is not finished: it has {} of {} episodes; it is still running, or can be resumed",
                self.records.len(),
                self.manifest.requested_episodes()
            ));
        }
        if let Some(shard) = shard {
            warnings.push(format!(
                "{dir} is the shard {shard} of a run, which softvt merge joins with the others"
            ));
        }
        if self.is_truncated {
            warnings.push(format!(
                "the last line of {dir}/{EPISODES} is truncated and was skipped; a resumed run executes that episode again"
            ));
        }
        if softvt != VERSION {
            warnings.push(format!(
                "{dir} was written by softvt {softvt}, and this is softvt {VERSION}: results of the two versions may differ"
            ));
        }
        if !modified.is_empty() {
            let names: Vec<&str> = modified.iter().map(String::as_str).collect();
            warnings.push(format!("{dir} has other files than softvt: {}", names.join(", ")));
        }
        warnings
    }
}

/// Reads the run in a folder, or the runs in its subfolders, sorted by name.
///
/// # Errors
/// The folder contains no run, or a run cannot be read.
pub fn load(dir: &Path) -> Result<Vec<StoredRun>, RunFolderError> {
    if dir.join(RUN).is_file() {
        return Ok(vec![load_one(dir)?]);
    }
    let name = dir.display();
    if dir.is_file() {
        return Err(RunFolderError::new(format_args!("{name} is a file; give the folder of a run")));
    }
    let mut inner: Vec<PathBuf> = match fs::read_dir(dir) {
        Ok(entries) => entries.filter_map(Result::ok).map(|entry| entry.path()).collect(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(RunFolderError::new(format_args!("folder {name} does not exist")));
        }
        Err(error) => return Err(FileError::io("read", dir)(error).into()),
    };
    inner.retain(|path| is_run(path));
    inner.sort();
    if inner.is_empty() {
        let found = match folder_of_runs(dir) {
            Some(inner) => format!("; those in {} are runs", inner.display()),
            None => format!(": neither the folder nor any of its subfolders has {RUN} and {EPISODES}"),
        };
        return Err(RunFolderError::new(format_args!("{name} holds no run{found}")));
    }
    inner.iter().map(|dir| load_one(dir)).collect()
}

fn is_run(dir: &Path) -> bool {
    dir.join(RUN).is_file() && dir.join(EPISODES).is_file()
}

/// The first folder in `dir` that holds runs, such as that of the attempts of a dataset.
fn folder_of_runs(dir: &Path) -> Option<PathBuf> {
    let folders = |dir: &Path| fs::read_dir(dir).into_iter().flatten().flatten().map(|entry| entry.path());
    folders(dir).filter(|inner| folders(inner).any(|path| is_run(&path))).min()
}

fn load_one(dir: &Path) -> Result<StoredRun, RunFolderError> {
    let manifest = RunManifest::read(dir)?;
    let mut records = read_episodes(dir, &manifest)?;
    records.sort_by_key(|record| record.header.id.index());
    let (is_finished, is_truncated) = (dir.join(SUMMARY).is_file(), is_truncated(dir));
    Ok(StoredRun { dir: dir.to_owned(), manifest, records, is_finished, is_truncated })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{run_folder::RunFolder, sample_manifest, sample_record};
    use softvt_common::files;

    #[test]
    fn lines_of_another_run_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let mut folder = RunFolder::create(dir.path(), &sample_manifest()).unwrap();
        folder.append(&sample_record()).unwrap();
        assert_eq!(load(dir.path()).unwrap()[0].records, [sample_record()]);
        let other = RunManifest { policy: "noop".to_owned(), ..sample_manifest() };
        files::write_json(&dir.path().join(RUN), &other).unwrap();
        let foreign = load(dir.path()).unwrap_err().to_string();
        assert!(
            foreign.contains("episodes.jsonl:1: task 0 episode 0 is not of the run that run.json describes"),
            "{foreign}"
        );
    }
}
