//! [`StoredRun`]: a finished or unfinished run, read from its folder.

use std::{
    cmp::Ordering,
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use serde_json::Value;

use super::{
    run_check::{RecordContradiction, first_contradiction},
    run_folder::{EPISODES, RUN, RunFolderError, SUMMARY, is_truncated, read_episodes},
};
use softvt_benchmark::run_changes::RunChanges;
use softvt_common::episode_id::EpisodeIndex;
use softvt_common::files::{self, FileError};
use softvt_runs::{
    record::{EpisodeRecord, PRIVILEGED_POLICIES},
    summary::MethodMarks,
};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Contents of a run folder.
#[derive(Clone, Debug)]
pub struct StoredRun {
    /// The folder.
    pub dir: PathBuf,
    /// Contents of `run.json`.
    pub manifest: Value,
    /// Records of its episodes, ordered by task and episode.
    pub records: Vec<EpisodeRecord>,
    /// True if the run came to its end.
    pub is_finished: bool,
    /// True if the last line of its episodes was truncated by a crash.
    pub is_truncated: bool,
}

/// Error of reading runs.
#[allow(missing_docs, reason = "the messages describe the variants")]
#[derive(Debug, thiserror::Error)]
pub enum StoredRunError {
    #[error(transparent)]
    Folder(#[from] RunFolderError),
    #[error(transparent)]
    Read(#[from] FileError),
    /// An error whose likely cause is that the run was written by another version.
    #[error(
        "{error}; this run was written by softvt {version}, and this is softvt {VERSION}: read it with that version"
    )]
    Version { error: Box<Self>, version: String },
    #[error("folder {dir} does not exist")]
    Missing { dir: String },
    #[error("{path} is a file; give the folder of a run")]
    File { path: String },
    #[error("{dir} holds an experiment, not a run of a suite; its rows are in {dir}/rows.jsonl")]
    Experiment { dir: String },
    #[error("{dir} holds no run: neither the folder nor any of its subfolders has {RUN} and {EPISODES}")]
    None { dir: String },
    #[error("{dir} holds no run; those in {inner} are runs")]
    Deeper { dir: String, inner: String },
    #[error("{path}:{line}: {episode} occurs twice (first in line {first}): remove one of the lines")]
    DuplicateEpisode { path: String, line: usize, first: usize, episode: EpisodeIndex },
    #[error("{path}:{line}: the record contradicts {RUN}: {what}; one of the two was changed after the run")]
    Contradiction { path: String, line: usize, what: String },
    #[error("{path} is not a valid run file: {what}")]
    Manifest { path: String, what: String },
}

/// Removes the folder in which a run was made from its manifest. Runs that differ in it alone are the same.
pub fn remove_folder(manifest: &mut Value) {
    if let Some(fields) = manifest.as_object_mut() {
        fields.shift_remove("folder");
    }
}

/// Records under the name of another suite. A rigid twin is paired with its soft original by task and episode.
pub(super) fn records_as(records: &[EpisodeRecord], suite: &str) -> Vec<EpisodeRecord> {
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
    /// Text field of `run.json`; empty if missing.
    pub fn text(&self, field: &str) -> &str {
        self.manifest[field].as_str().unwrap_or_default()
    }

    /// Name of the suite in the results, which differs from that in `run.json` for a rigid twin.
    pub fn suite(&self) -> &str {
        self.records.first().map_or(self.text("suite"), |record| &record.header.id.suite)
    }

    /// Name of the suite whose initial states the run has: for a rigid twin that of its soft original.
    pub fn original_suite(&self) -> &str {
        self.manifest["twin_of"].as_str().unwrap_or_else(|| self.text("suite"))
    }

    /// True if soft objects were made rigid.
    pub fn is_rigid_twin(&self) -> bool {
        self.manifest["twin_of"].is_string() || self.changes().is_rigid_twin()
    }

    /// True if the policy has access to ground-truth state, by `run.json` or by its name.
    pub fn is_privileged(&self) -> bool {
        self.manifest["privileged"] == true || PRIVILEGED_POLICIES.contains(&self.text("policy"))
    }

    /// Marks of the policy: knowledge beyond what a robot measures, and repeated actions.
    pub fn marks(&self) -> MethodMarks {
        MethodMarks {
            privileged: self.is_privileged(),
            replayed: self.manifest["replayed"].is_object(),
            force_observed: self.observes_forces(),
        }
    }

    /// True if the policy keeps one number constant, by what shows of an object. Runs of earlier versions do not say
    /// so.
    pub fn is_blind_bound(&self) -> bool {
        self.manifest["blind"].as_bool() == Some(true)
    }

    /// True if the policy observes ground-truth forces at the pads.
    pub fn observes_forces(&self) -> bool {
        self.manifest["force_observed"].as_bool() == Some(true)
    }

    /// The record of an episode.
    pub fn record(&self, index: EpisodeIndex) -> Option<&EpisodeRecord> {
        self.records.iter().find(|record| record.header.id.index() == index)
    }

    /// Number of episodes of the complete run or shard.
    pub fn requested_episodes(&self) -> usize {
        let tasks = self.manifest["tasks"].as_array().map_or(0, Vec::len);
        let all = tasks * self.manifest["episodes"].as_u64().unwrap_or(0) as usize;
        let shard = self.text("shard").split_once('/');
        match shard.and_then(|(i, n)| Some((i.parse::<usize>().ok()?, n.parse::<usize>().ok()?))) {
            Some((index, count)) if index > 0 && count > 0 => (all + count - index.min(all + count)) / count,
            _ => all,
        }
    }

    /// True if episodes are missing: the run is in progress or was interrupted.
    pub fn is_partial(&self) -> bool {
        !self.is_finished || self.records.len() < self.requested_episodes()
    }

    /// The changes of the suite that `run.json` states; it was checked on reading.
    pub fn changes(&self) -> RunChanges {
        RunChanges::of_manifest(&self.manifest).unwrap_or_default()
    }

    /// The changes to the suite; `None` for a suite as it is.
    pub fn condition(&self) -> Option<ConditionLabel> {
        let twin = self.is_rigid_twin().then(|| "rigid twin".to_owned());
        let changes = self.changes();
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
        let text = |field: &str| self.text(field).to_owned();
        let RunChanges { seed, vary, .. } = self.changes();
        [
            self.original_suite().to_owned(),
            text("policy"),
            seed.to_string(),
            text("split"),
            vary.unwrap_or_default(),
        ]
    }

    /// Warnings for a reader of the results, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let dir = self.dir.display();
        if self.is_partial() {
            warnings.push(format!(
                "{dir} is not finished: it has {} of {} episodes; it is still running, or can be resumed",
                self.records.len(),
                self.requested_episodes()
            ));
        }
        let shard = self.text("shard");
        if !shard.is_empty() {
            warnings.push(format!(
                "{dir} is the shard {shard} of a run, which softvt merge joins with the others"
            ));
        }
        if self.is_truncated {
            warnings.push(format!(
                "the last line of {dir}/{EPISODES} is truncated and was skipped; a resumed run executes that episode again"
            ));
        }
        if self.text("softvt") != VERSION {
            warnings.push(format!(
                "{dir} was written by softvt {}, and this is softvt {VERSION}: results of the two versions may differ",
                self.text("softvt")
            ));
        }
        let modified = self.manifest["modified"].as_array().into_iter().flatten();
        let modified: Vec<&str> = modified.filter_map(Value::as_str).collect();
        if !modified.is_empty() {
            warnings.push(format!("{dir} has other files than softvt: {}", modified.join(", ")));
        }
        warnings
    }
}

/// Reads the run in a folder, or the runs in its subfolders, sorted by name.
///
/// # Errors
/// The folder contains no run, or a run cannot be read.
pub fn load(dir: &Path) -> Result<Vec<StoredRun>, StoredRunError> {
    if dir.join(RUN).is_file() {
        return Ok(vec![load_one(dir)?]);
    }
    let name = || dir.display().to_string();
    if dir.is_file() {
        return Err(StoredRunError::File { path: name() });
    }
    let mut inner: Vec<PathBuf> = match fs::read_dir(dir) {
        Ok(entries) => entries.filter_map(Result::ok).map(|entry| entry.path()).collect(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(StoredRunError::Missing { dir: name() });
        }
        Err(error) => return Err(FileError::io("read", dir)(error).into()),
    };
    inner.retain(|path| is_run(path));
    inner.sort();
    if inner.is_empty() {
        return Err(match folder_of_runs(dir) {
            Some(inner) => StoredRunError::Deeper { dir: name(), inner: inner.display().to_string() },
            None => StoredRunError::None { dir: name() },
        });
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

fn load_one(dir: &Path) -> Result<StoredRun, StoredRunError> {
    let path = dir.join(RUN);
    let invalid = |what: String| StoredRunError::Manifest { path: path.display().to_string(), what };
    let manifest: Value =
        serde_json::from_str(&files::read_text(&path)?).map_err(|e| invalid(e.to_string()))?;
    if manifest["experiment"].is_string() {
        return Err(StoredRunError::Experiment { dir: dir.display().to_string() });
    }
    let version = manifest["softvt"].as_str().unwrap_or_default().to_owned();
    let read = || {
        let has = |field: &str, is_type: fn(&Value) -> bool| {
            is_type(&manifest[field]).then_some(()).ok_or_else(|| invalid(format!("it has no {field}")))
        };
        ["softvt", "script", "suite", "policy"].iter().try_for_each(|field| has(field, Value::is_string))?;
        has("tasks", Value::is_array)?;
        has("episodes", Value::is_u64)?;
        RunChanges::of_manifest(&manifest).map_err(|error| invalid(error.to_string()))?;
        if !is_shard(&manifest["shard"]) {
            let what = format!("its shard is {}; expected I/N with 1 <= I <= N", manifest["shard"]);
            return Err(invalid(what));
        }
        let replayed = &manifest["replayed"];
        let is_privileged = |policy: &Value| {
            policy["privileged"] == true
                || policy["policy"].as_str().is_some_and(|name| PRIVILEGED_POLICIES.contains(&name))
        };
        if is_privileged(replayed) && manifest["privileged"] == false {
            return Err(invalid(format!(
                "privileged is false, and it replays {}, which is privileged",
                replayed["policy"]
            )));
        }
        let mut records = read_episodes(dir)?;
        check_unique(dir, &records)?;
        check_records(dir, &manifest, &records)?;
        records.sort_by_key(|r| r.header.id.index());
        let (is_finished, is_truncated) = (dir.join(SUMMARY).is_file(), is_truncated(dir));
        Ok(StoredRun { dir: dir.to_owned(), manifest: manifest.clone(), records, is_finished, is_truncated })
    };
    read().map_err(|error| match version == VERSION || version.is_empty() {
        true => error,
        false => StoredRunError::Version { error: Box::new(error), version },
    })
}

/// True for a shard I/N with 1 ≤ I ≤ N, and for the null of a whole run.
fn is_shard(shard: &Value) -> bool {
    let Some(text) = shard.as_str() else { return shard.is_null() };
    let numbers =
        text.split_once('/').and_then(|(i, n)| Some((i.parse::<u32>().ok()?, n.parse::<u32>().ok()?)));
    numbers.is_some_and(|(index, count)| (1..=count).contains(&index))
}

/// Checks that the records, in the order of their lines, are of the run of this manifest.
fn check_records(dir: &Path, manifest: &Value, records: &[EpisodeRecord]) -> Result<(), StoredRunError> {
    first_contradiction(manifest, records).map_or(Ok(()), |RecordContradiction { line, what }| {
        Err(StoredRunError::Contradiction { path: dir.join(EPISODES).display().to_string(), line, what })
    })
}

/// Checks that no episode has two lines, since it would count twice.
fn check_unique(dir: &Path, records: &[EpisodeRecord]) -> Result<(), StoredRunError> {
    let mut lines: BTreeMap<EpisodeIndex, usize> = BTreeMap::new();
    for (number, record) in records.iter().enumerate() {
        let (line, episode) = (number + 1, record.header.id.index());
        if let Some(first) = lines.insert(episode, line) {
            let path = dir.join(EPISODES).display().to_string();
            return Err(StoredRunError::DuplicateEpisode { path, line, first, episode });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_record;

    #[test]
    fn shards_that_do_not_exist_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let load_shard = |shard: Value| {
            let manifest = serde_json::json!({
                "softvt": VERSION, "script": "x.lua", "suite": "suite", "policy": "expert", "tasks": [0], "episodes": 1,
                "arguments": [], "shifts": [], "set": [], "seed": 11, "shard": shard,
            });
            files::write_json(&root.path().join(RUN), &manifest).unwrap();
            files::write_json_lines(&root.path().join(EPISODES), &[sample_record()]).unwrap();
            load(root.path())
        };
        assert!(load_shard(Value::Null).is_ok() && load_shard("2/2".into()).is_ok());
        for shard in ["99/2", "0/0", "0/2", "x/2", "2"] {
            let error = load_shard(shard.into()).unwrap_err().to_string();
            let expected = format!("run.json is not a valid run file: its shard is \"{shard}\"");
            assert!(error.contains(&expected), "{error}");
        }
        assert!(load_shard(1.into()).is_err());
    }

    #[test]
    fn a_replay_of_a_privileged_run_that_is_not_privileged_is_refused() {
        let root = tempfile::tempdir().unwrap();
        let load_replay = |replayed: Value| {
            let manifest = serde_json::json!({
                "softvt": VERSION, "script": "x.lua", "suite": "suite", "policy": "pi05", "tasks": [0], "episodes": 1,
                "arguments": [], "shifts": [], "set": [], "seed": 11, "privileged": false, "replayed": replayed,
            });
            files::write_json(&root.path().join(RUN), &manifest).unwrap();
            files::write_json_lines(&root.path().join(EPISODES), &[] as &[EpisodeRecord]).unwrap();
            load(root.path()).map_or_else(|error| error.to_string(), |_| String::new())
        };
        assert_eq!(load_replay(serde_json::json!({ "policy": "mine", "privileged": false })), "");
        for (policy, privileged) in [("expert-binary", false), ("mine", true)] {
            let message = load_replay(serde_json::json!({ "policy": policy, "privileged": privileged }));
            let expected = format!("privileged is false, and it replays {policy:?}, which is privileged");
            assert!(message.ends_with(&expected), "{message}");
        }
    }

    #[test]
    fn doubled_lines_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let manifest = serde_json::json!({
            "softvt": VERSION, "script": "x.lua", "suite": "suite", "policy": "expert", "tasks": [0], "episodes": 1,
            "arguments": [], "shifts": [], "set": [], "seed": 11,
        });
        files::write_json(&root.path().join(RUN), &manifest).unwrap();
        let lines = root.path().join(EPISODES);
        files::write_json_lines(&lines, &[sample_record()]).unwrap();
        assert_eq!(load(root.path()).unwrap()[0].records.len(), 1);
        files::write_json_lines(&lines, &[sample_record(), sample_record()]).unwrap();
        let error = load(root.path()).unwrap_err().to_string();
        let expected =
            "episodes.jsonl:2: task 0 episode 0 occurs twice (first in line 1): remove one of the lines";
        assert!(error.ends_with(expected), "{error}");
    }
}
