//! [`RunManifest`]: `run.json`, everything needed to repeat a run.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use serde::{Deserialize, Serialize};

use super::{
    json_difference::json_difference,
    record::{EpisodeRecord, PRIVILEGED_POLICIES},
    run_folder::{RUN, RunFolderError},
    shard::Shard,
};
use softvt_benchmark::{
    NeededKnowledge, ShiftValue,
    run_changes::{RunChanges, Twin},
    settings::Settings,
    variation::VariationRanges,
};
use softvt_common::{
    episode_id::{EpisodeIndex, EpisodeSplit},
    files,
};
use softvt_policy::profile::{GripCode, Profile};

/// The version of softvt that writes run folders.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    pub softvt: String,
    /// The script, relative to `folder`.
    pub script: String,
    /// Name of the suite in its script; that in results may have a suffix ([`RunChanges::suite_name`]).
    pub suite: String,
    /// True if the script returned more than this suite.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub several_suites: bool,
    /// The twin of the suite that is run in its place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin: Option<Twin>,
    /// Ranges within which the episodes vary, if they do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variation: Option<VariationRanges>,
    /// File of `--vary`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vary: Option<String>,
    /// Knowledge that a safe grip needs, if the suite states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs: Option<NeededKnowledge>,
    /// The suite whose rigid twin this one is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin_of: Option<String>,
    pub policy: String,
    /// Profile of a policy server, or of the clients of `softvt serve`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    /// Grip code of the profile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gripper: Option<GripCode>,
    /// True if clients of `softvt serve` have stepped the episodes.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub served: bool,
    /// File of a policy in Lua. Its SHA-256 is among the sources.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub policy_file: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub replayed: Option<ReplaySource>,
    /// Files of the demonstrations that were re-executed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub imported: Vec<ImportedFile>,
    /// Actions executed from each chunk.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub replan: Option<usize>,
    /// True if the policy has access to ground-truth state.
    pub privileged: bool,
    /// True if the policy keeps one number constant, by what shows of an object.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub blind: bool,
    /// Base seed; the public one of a judged run.
    pub seed: u64,
    /// Hash of the secret of a judged run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed_hash: Option<String>,
    pub split: EpisodeSplit,
    pub tasks: Vec<usize>,
    pub episodes: u32,
    /// The episodes of each task, if only some are run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub selected_episodes: Vec<u32>,
    /// The part of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    pub shifts: Vec<ShiftValue>,
    /// Values of all options of the script.
    pub options: BTreeMap<String, String>,
    /// Options of the script as they were typed.
    pub arguments: Vec<String>,
    /// Arguments of `--set`.
    pub set: Vec<(String, String)>,
    /// Settings of the suite with the changes of the run.
    pub settings: Settings,
    /// SHA-256 of files by name.
    pub sources: BTreeMap<String, String>,
    /// Files that are not as in the library of the binary, by their path there.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub modified: BTreeSet<String>,
    /// Definition of D and of its limits.
    pub metric_id: String,
    /// τ by asset, %.
    pub thresholds: BTreeMap<String, Option<f64>>,
    /// True if the policy observes the true forces on the pads.
    pub force_observed: bool,
    /// The working folder, to which the paths above are relative. Absent in recorded files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folder: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReplaySource {
    /// The folder, as it was typed.
    pub run: String,
    pub policy: String,
    /// True if the recorded policy had access to ground-truth state.
    pub privileged: bool,
    /// True if the recorded policy observed the true forces on the pads.
    pub force_observed: bool,
    /// SHA-256 of the episodes and their actions.
    pub sha256: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImportedFile {
    pub file: String,
    pub sha256: String,
    /// Name of its format, such as SoftVTBench.
    pub format: String,
    pub demos: usize,
    /// Source of the executed commands.
    pub commands: String,
}

impl RunManifest {
    /// Reads the manifest of the run folder `dir`.
    ///
    /// # Errors
    /// The folder is of an experiment or of another version, or its file is not valid.
    pub fn read(dir: &Path) -> Result<Self, RunFolderError> {
        let path = dir.join(RUN);
        Self::parse(&path, &files::read_text(&path)?)
    }

    /// Reads a manifest that is part of the file `path`.
    ///
    /// # Errors
    /// The text is of an experiment or of another version, or is not a manifest.
    pub fn parse(path: &Path, text: &str) -> Result<Self, RunFolderError> {
        /// The keys that distinguish kinds of manifests.
        #[derive(Deserialize)]
        struct Head {
            softvt: String,
            experiment: Option<String>,
        }
        let head: Option<Head> = serde_json::from_str(text).ok();
        serde_json::from_str(text).map_err(|error| match head {
            Some(Head { experiment: Some(_), .. }) => {
                let dir = path.parent().unwrap_or(path).display();
                let what = "holds an experiment, not a run of a suite; its rows are in";
                RunFolderError::new(format_args!("{dir} {what} {dir}/rows.jsonl"))
            }
            Some(Head { softvt: version, .. }) if version != VERSION => Self::other_version(path, &version),
            _ => not_a_manifest(path, &error),
        })
    }

    /// The error about a file of a run of another version of softvt.
    pub(crate) fn other_version(path: &Path, version: &str) -> RunFolderError {
        let path = path.display();
        let what = format_args!(
            "{path} was written by softvt {version} in another format: read it with that version"
        );
        RunFolderError::new(what)
    }

    pub fn changes(&self) -> RunChanges {
        RunChanges {
            arguments: self.arguments.clone(),
            shifts: self.shifts.clone(),
            set: self.set.clone(),
            twin: self.twin,
            vary: self.vary.clone(),
            seed: self.seed,
            seed_hash: self.seed_hash.clone(),
        }
    }

    /// True if the policy has access to ground-truth state, or had it when its actions were recorded; also for the name
    /// of a policy that has.
    pub fn is_privileged(&self) -> bool {
        let is_privileged_name = |name: &String| PRIVILEGED_POLICIES.contains(&name.as_str());
        let replayed = self.replayed.as_ref();
        self.privileged
            || is_privileged_name(&self.policy)
            || replayed.is_some_and(|source| source.privileged || is_privileged_name(&source.policy))
    }

    /// Number of episodes of the complete run or shard.
    pub fn requested_episodes(&self) -> usize {
        let all = self.tasks.len() * self.episodes as usize;
        self.shard.map_or(all, |shard| shard.len(all))
    }

    /// True if the run has an episode. A recording makes as many attempts as its demonstrations take.
    pub fn has_episode(&self, EpisodeIndex { task, episode }: EpisodeIndex) -> bool {
        let is_selected = match &self.selected_episodes[..] {
            [] => episode < self.episodes || self.split == EpisodeSplit::Demonstration,
            selected => selected.contains(&episode),
        };
        is_selected && self.tasks.contains(&task)
    }

    /// True if a record is of an episode of this run.
    pub(crate) fn has_record(&self, record: &EpisodeRecord) -> bool {
        let (header, id) = (&record.header, &record.header.id);
        id.suite == self.changes().suite_name(&self.suite)
            && (id.base_seed, id.split) == (self.seed, self.split)
            && (&header.policy, header.privileged) == (&self.policy, self.privileged)
            && header.replayed == self.replayed.is_some()
            && self.has_episode(id.index())
    }

    /// The manifest without what does not tell one run from another: the folder in which its command ran, and the files
    /// that its binary has in another version.
    pub(crate) fn identity(&self) -> Self {
        Self { folder: None, modified: BTreeSet::new(), ..self.clone() }
    }

    /// Writes the manifest into a run folder. One that is there must be of the same run.
    pub(crate) fn write_or_compare(&self, dir: &Path) -> Result<(), RunFolderError> {
        match dir.join(RUN).exists() {
            true => check_same(dir, &Self::read(dir)?.identity(), &self.identity()),
            false => Ok(files::write_json(&dir.join(RUN), self)?),
        }
    }

    /// True if the folder has the manifest of this very run.
    pub fn is_in(&self, dir: &Path) -> bool {
        Self::read(dir).is_ok_and(|stored| stored.identity() == self.identity())
    }

    /// Keys about the conditions of a run in which two runs of one suite differ, with the names of differing files
    /// and limits in brackets.
    pub fn differing_conditions(&self, other: &Self) -> Vec<String> {
        let differs = [
            ("softvt", self.softvt != other.softvt),
            ("metric_id", self.metric_id != other.metric_id),
            ("twin", self.twin != other.twin),
            ("variation", self.variation != other.variation),
            ("shifts", self.shifts != other.shifts),
            ("options", self.options != other.options),
            ("settings", self.settings != other.settings),
        ];
        let names = differs.into_iter().filter(|(_, differs)| *differs).map(|(name, _)| name.to_owned());
        names.chain(self.differing_files(other)).collect()
    }

    /// The keys `sources` and `thresholds`, if the runs differ in an entry that both have, with the names of these
    /// entries in brackets. A run of fewer tasks has fewer.
    pub fn differing_files(&self, other: &Self) -> Vec<String> {
        fn differing<V: PartialEq>(a: &BTreeMap<String, V>, b: &BTreeMap<String, V>) -> Option<String> {
            let b: BTreeMap<&str, &V> = b.iter().map(|(name, value)| (in_project(name), value)).collect();
            let a = a.iter().map(|(name, value)| (in_project(name), value));
            let is_other = |(name, value): &(&str, &V)| b.get(name).is_some_and(|other| other != value);
            let names: Vec<&str> = a.filter(is_other).map(|(name, _)| name).collect();
            (!names.is_empty()).then(|| names.join(", "))
        }
        let sources = differing(&self.sources, &other.sources).map(|names| format!("sources ({names})"));
        let limits = differing(&self.thresholds, &other.thresholds);
        sources.into_iter().chain(limits.map(|names| format!("thresholds ({names})"))).collect()
    }
}

/// The path of a file in its project, whatever the folder from which a run named it: `../scripts/shifts.lua` is
/// `scripts/shifts.lua`.
pub fn in_project(path: &str) -> &str {
    let folders = ["scripts/", "suites/", "assets/"];
    let starts = folders.iter().filter_map(|folder| path.find(folder));
    let start = starts.filter(|at| *at == 0 || path[..*at].ends_with('/')).min();
    start.map_or(path, |at| &path[at..])
}

/// Content of the `run.json` of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExperimentManifest {
    pub softvt: String,
    /// The script, relative to `folder`.
    pub script: String,
    pub experiment: String,
    pub points: usize,
    pub seed: u64,
    /// Values of all options of the script.
    pub options: BTreeMap<String, String>,
    /// Options of the script as they were typed.
    pub arguments: Vec<String>,
    /// The settings that are not those of the script.
    pub set: Vec<(String, String)>,
    /// SHA-256 of files by name.
    pub sources: BTreeMap<String, String>,
    /// The working folder, to which the paths above are relative.
    pub folder: String,
}

impl ExperimentManifest {
    /// Writes the manifest into the folder of an experiment. One that is there must be of the same experiment.
    pub(crate) fn write_or_compare(&self, dir: &Path) -> Result<(), RunFolderError> {
        let path = dir.join(RUN);
        if !path.exists() {
            return Ok(files::write_json(&path, self)?);
        }
        let stored: Self =
            serde_json::from_str(&files::read_text(&path)?).map_err(|error| not_a_manifest(&path, &error))?;
        check_same(dir, &Self { folder: self.folder.clone(), ..stored }, self)
    }
}

/// The working folder, as manifests name it.
pub fn working_folder() -> String {
    std::env::current_dir().map(|dir| dir.display().to_string()).unwrap_or_default()
}

fn not_a_manifest(path: &Path, error: &serde_json::Error) -> RunFolderError {
    RunFolderError::new(format_args!("{} is not a valid run file: {error}", path.display()))
}

/// Checks that the manifest in a folder is that of the run which is continued.
fn check_same<M: Serialize>(dir: &Path, stored: &M, own: &M) -> Result<(), RunFolderError> {
    json_difference(stored, own).map_or(Ok(()), |what| {
        let path = dir.join(RUN);
        let remedy = "resume it with its original arguments, or select another output folder";
        let path = path.display();
        Err(RunFolderError::new(format_args!("{path} belongs to another run: {what}; {remedy}")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{sample_manifest, sample_record};

    /// A `run.json` with every key.
    const ALL_KEYS: &str = include_str!("../../tests/data/run_all_keys.json");

    #[test]
    fn the_bytes_of_run_json_stay() {
        for text in [ALL_KEYS, include_str!("../../tests/data/run.json")] {
            let manifest = RunManifest::parse(Path::new("run.json"), text).unwrap();
            let dir = tempfile::tempdir().unwrap();
            manifest.write_or_compare(dir.path()).unwrap();
            assert!(files::read_text(&dir.path().join(RUN)).unwrap() == text, "other bytes");
            assert_eq!(RunManifest::read(dir.path()).unwrap(), manifest);
        }
    }

    #[test]
    fn a_manifest_of_another_version_or_kind_is_named() {
        let error =
            |text: String| RunManifest::parse(Path::new("a/run.json"), &text).unwrap_err().to_string();
        let whole = serde_json::to_string(&sample_manifest()).unwrap();
        let no_tasks = whole.replace("\"tasks\"", "\"jobs\"");
        assert!(
            error(no_tasks.clone()).starts_with("a/run.json is not a valid run file: missing field `tasks`")
        );
        let old = no_tasks.replace(&format!("\"softvt\":\"{VERSION}\""), "\"softvt\":\"0.2.0\"");
        assert_eq!(
            error(old),
            "a/run.json was written by softvt 0.2.0 in another format: read it with that version"
        );
        let experiment = format!("{{\"softvt\":\"{VERSION}\",\"experiment\":\"sweep\"}}");
        assert!(error(experiment).contains("a holds an experiment, not a run of a suite"));
        for shard in ["\"99/2\"", "\"0/0\"", "\"0/2\"", "\"x/2\"", "\"2\"", "1"] {
            let text = whole.replacen("\"shifts\"", &format!("\"shard\":{shard},\"shifts\""), 1);
            assert!(error(text).contains("is not a valid run file"), "{shard}");
        }
    }

    #[test]
    fn a_record_of_another_run_is_found() {
        let (manifest, record) = (sample_manifest(), sample_record());
        assert!(manifest.has_record(&record));
        let changes: [fn(&mut RunManifest); 8] = [
            |run| run.suite.push('x'),
            |run| run.seed += 1,
            |run| run.split = EpisodeSplit::Demonstration,
            |run| run.policy.push('x'),
            |run| run.privileged = !run.privileged,
            |run| run.tasks.clear(),
            |run| run.episodes = 0,
            |run| run.selected_episodes = vec![7],
        ];
        for (number, change) in changes.into_iter().enumerate() {
            let mut other = manifest.clone();
            change(&mut other);
            assert!(!other.has_record(&record), "change {number}");
        }
    }

    #[test]
    fn what_repeats_a_privileged_policy_is_privileged() {
        let replay = |policy: &str, privileged| {
            let mut manifest = sample_manifest();
            (manifest.policy, manifest.privileged) = ("pi05".to_owned(), false);
            let (run, policy) = ("runs/a".to_owned(), policy.to_owned());
            let source =
                ReplaySource { run, policy, privileged, force_observed: false, sha256: String::new() };
            manifest.replayed = Some(source);
            manifest.is_privileged()
        };
        assert!(replay("expert-binary", false) && replay("mine", true) && !replay("mine", false));
    }

    #[test]
    fn another_folder_or_binary_is_not_another_run() {
        let dir = tempfile::tempdir().unwrap();
        let write = |manifest: &RunManifest| manifest.write_or_compare(dir.path());
        let mut manifest = sample_manifest();
        write(&manifest).unwrap();
        (manifest.folder, manifest.modified) =
            (Some("/elsewhere".into()), ["scripts/shifts.lua".into()].into());
        write(&manifest).unwrap();
        manifest.settings.physics.dt = 0.01;
        let error = write(&manifest).unwrap_err().to_string();
        assert!(error.contains("belongs to another run: settings.physics.dt: "), "{error}");
    }

    #[test]
    fn only_files_and_limits_that_both_runs_have_are_compared() {
        let of = |sources: &[(&str, &str)], limits: &[(&str, f64)]| {
            let mut manifest = sample_manifest();
            let text = |(name, hash): &(&str, &str)| ((*name).to_owned(), (*hash).to_owned());
            manifest.sources = sources.iter().map(text).collect();
            manifest.thresholds = limits.iter().map(|(name, tau)| ((*name).to_owned(), Some(*tau))).collect();
            manifest
        };
        let whole =
            of(&[("x.lua", "1"), ("../scripts/y.lua", "2"), ("z.lua", "3")], &[("bun", 1.0), ("pie", 2.0)]);
        let mut part = of(&[("x.lua", "1"), ("scripts/y.lua", "2")], &[("bun", 1.0)]);
        assert!(whole.differing_conditions(&part).is_empty());
        part = of(&[("x.lua", "1"), ("scripts/y.lua", "9")], &[("bun", 1.5)]);
        assert_eq!(whole.differing_files(&part), ["sources (scripts/y.lua)", "thresholds (bun)"]);
        part.settings.physics.dt = 0.01;
        assert_eq!(whole.differing_conditions(&part)[0], "settings");
        assert_eq!((in_project("x.lua"), in_project("my_suites/x.lua")), ("x.lua", "my_suites/x.lua"));
    }
}
