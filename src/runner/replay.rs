//! Re-simulation of recorded episodes and demonstrations by their actions, and comparison with their records.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::{
    config::{ConfiguredScript, RunConfig, thread_count},
    episode_list::{EpisodeJob, EpisodeList},
    episode_selector::EpisodeSelector,
    error::RunError,
    observer::Observer,
    policy::{ControllerFactory, PolicyConfig, PolicyOptions, PolicySource},
    stored_scripts::StoredScripts,
    suite_run::{ImportedDemos, PreparedRun, SuiteRun},
    suite_selection::{select_tasks, suites_of},
};
use softvt_benchmark::{Suite, seed::SecretSeed};
use softvt_common::{cancel, episode_id::EpisodeIndex, parallel};
use softvt_dataset::{TaskFile, manifest};
use softvt_evaluation::verdict::Outcome;
use softvt_policy::{Action, builtin::RecordedPolicy};
use softvt_rollout::{ChunkedPolicy, FinishedEpisode, StateRecording};
use softvt_runs::{
    actions, json_difference::json_difference, manifest::RunManifest, record::EpisodeRecord,
    stored_run::StoredRun,
};
use softvt_script::LoadedScript;

/// A controller factory that repeats the actions of a recorded episode, and its error if it ended with one.
pub(crate) fn replay_factory(recorded: Vec<Action>, record: &EpisodeRecord) -> ControllerFactory {
    let ending = match &record.outcome {
        Outcome::Error { message } => Some(message.clone()),
        _ => None,
    };
    Box::new(move |_, brief| {
        let policy = RecordedPolicy::from_actions(&recorded, ending.clone());
        Ok(Box::new(ChunkedPolicy::new(Box::new(policy), brief, 1)))
    })
}

/// Copies from `record` what a re-simulation does not produce: the policy, what it observed, and why it gave up.
pub(crate) fn with_policy_fields(mut simulated: EpisodeRecord, record: &EpisodeRecord) -> EpisodeRecord {
    simulated.header.policy.clone_from(&record.header.policy);
    simulated.header.privileged = record.header.privileged;
    simulated.header.replayed = record.header.replayed;
    simulated.stats.attempts = record.stats.attempts;
    simulated.stats.force_observed = record.stats.force_observed;
    simulated.stats.camera_inside = record.stats.camera_inside;
    simulated.stats.gave_up.clone_from(&record.stats.gave_up);
    simulated.stats.notes.clone_from(&record.stats.notes);
    simulated.stats.clamped_steps = record.stats.clamped_steps;
    simulated
}

/// Describes the first difference of two records. `None` if they are byte-identical.
pub(crate) fn difference(
    recorded: &EpisodeRecord,
    simulated: &EpisodeRecord,
) -> Result<Option<String>, RunError> {
    if serde_json::to_string(recorded)? == serde_json::to_string(simulated)? {
        return Ok(None);
    }
    Ok(Some(json_difference(recorded, simulated).unwrap_or_default()))
}

/// A run or dataset file, and its manifest.
pub(crate) struct StoredManifest<'a> {
    /// The file, as messages name it.
    pub path: &'a Path,
    pub manifest: &'a RunManifest,
    /// Secret of a judged run, with the file that holds it.
    pub secret: Option<&'a SecretFile>,
    pub observer: Arc<dyn Observer>,
}

/// The secret in a seed file.
pub struct SecretFile {
    pub path: PathBuf,
    pub secret: SecretSeed,
}

impl StoredManifest<'_> {
    /// Simulates an episode again by its `actions`. The policy fields of the result are copied from `record`.
    fn simulate(
        &self,
        record: &EpisodeRecord,
        actions: Vec<Action>,
        keeps_states: bool,
    ) -> Result<FinishedEpisode, RunError> {
        let finished = self.simulate_with(record, replay_factory(actions, record), keeps_states)?;
        Ok(FinishedEpisode { record: with_policy_fields(finished.record, record), ..finished })
    }

    fn simulate_with(
        &self,
        record: &EpisodeRecord,
        controllers: ControllerFactory,
        keeps_states: bool,
    ) -> Result<FinishedEpisode, RunError> {
        let index = record.header.id.index();
        let config = self.config(index.task)?;
        let ConfiguredScript { config, script: loaded } = config.load()?;
        let suite = self.suite(&loaded)?;
        let tasks = select_tasks(&config, suite)?;
        let job = EpisodeJob { task: tasks[0], episode: index.episode };
        let run = SuiteRun {
            controllers,
            import: ImportedDemos {
                origins: record.header.origin.iter().map(|origin| (index, (**origin).clone())).collect(),
                files: Vec::new(),
            },
            ..SuiteRun::new(&config, &loaded, suite, EpisodeList::listed(vec![job]), self.manifest.split)?
        };
        let run = if keeps_states { run.rendered() } else { run }.prepare()?;
        self.check_sources(&run)?;
        run.run_episode(job, keeps_states, &run.controllers)
    }

    /// The configuration of the run, for one task and with a policy whose actions come from elsewhere.
    pub(crate) fn config(&self, task: usize) -> Result<RunConfig, RunError> {
        let changes = self.manifest.changes();
        let secret = self.secret(changes.seed_hash.as_deref())?.cloned();
        Ok(RunConfig {
            policy: PolicyConfig::external("replay"),
            tasks: vec![task.to_string()],
            stored_scripts: StoredScripts::read(self.path, &self.manifest.sources)?,
            observer: self.observer.clone(),
            ..RunConfig::of(&self.manifest.script).with_changes(changes, secret)
        })
    }

    /// The secret of the run, if it was judged with one.
    fn secret(&self, seed_hash: Option<&str>) -> Result<Option<&SecretSeed>, RunError> {
        let path = self.path.display();
        match (seed_hash, self.secret) {
            (None, None) => Ok(None),
            (Some(hash), Some(given)) if given.secret.hash() == hash => Ok(Some(&given.secret)),
            (Some(hash), Some(given)) => Err(RunError::of_setting(
                "secret",
                given.path.display(),
                format!("its hash is {}, that of {path} is {hash}", given.secret.hash()),
            )),
            (Some(_), None) => Err(RunError::input(format_args!(
                "{path}: the run was judged with a secret seed; give the file with that seed"
            ))),
            (None, Some(given)) => Err(RunError::of_setting(
                "secret",
                given.path.display(),
                format!("{path} has no secret seed; leave it out"),
            )),
        }
    }

    pub(crate) fn suite<'a>(&self, loaded: &'a LoadedScript) -> Result<&'a Suite, RunError> {
        let RunManifest { script, suite: name, .. } = self.manifest;
        let suite = suites_of(&loaded.plan).iter().find(|suite| suite.name == *name);
        suite.ok_or_else(|| RunError::input(format_args!("{script} no longer has a suite {name:?}")))
    }

    /// Checks that scripts and thresholds are those of the stored run.
    fn check_sources(&self, run: &PreparedRun) -> Result<(), RunError> {
        let before = self.manifest.sources.iter();
        let changed: Vec<&str> = before
            .filter(|(name, hash)| run.sources.get(*name).is_some_and(|current| current != *hash))
            .map(|(name, _)| name.as_str())
            .collect();
        if changed.is_empty() {
            return Ok(());
        }
        Err(RunError::input(format_args!(
            "{}: {} changed since the run; restore the earlier version, or run again",
            self.path.display(),
            changed.join(", ")
        )))
    }
}

/// The configuration of a run, with a policy that repeats its actions. A judged run needs its `secret`.
///
/// # Errors
/// The run is of another version, or cannot be read.
pub fn recorded_config(
    run: &StoredRun,
    secret: Option<&SecretFile>,
    observer: Arc<dyn Observer>,
) -> Result<RunConfig, RunError> {
    let stored = StoredManifest { path: &run.dir, manifest: &run.manifest, secret, observer };
    let policy = PolicyConfig::load(&PolicyOptions::new(PolicySource::Run(run.dir.clone())))?;
    Ok(RunConfig { tasks: Vec::new(), policy, ..stored.config(0)? })
}

/// The manifest of the recording of an HDF5 file.
pub(crate) fn recorded_manifest(file: &TaskFile) -> Result<RunManifest, RunError> {
    Ok(RunManifest::parse(&file.path, &file.environment()?["env_kwargs"].to_string())?)
}

/// A demonstration: its file, and its number in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DemoRef {
    pub file: PathBuf,
    pub demo: usize,
}

pub struct DemoReplay {
    pub state_hash: String,
    /// First difference from the recording. `None` if they are byte-identical.
    pub difference: Option<String>,
    /// Goal Success of the re-simulation.
    pub goal_reached: bool,
}

/// All demonstrations of a dataset folder, or of one HDF5 file.
///
/// # Errors
/// The manifest or file cannot be read.
pub fn demos_of(path: &Path) -> Result<Vec<DemoRef>, RunError> {
    if path.is_dir() {
        let entries = manifest::read(path)?;
        let demos =
            entries.iter().map(|entry| DemoRef { file: path.join(&entry.hdf5_path), demo: entry.demo_id });
        return Ok(demos.collect());
    }
    let file = TaskFile::open(path)?;
    Ok(file.demos.iter().map(|demo| DemoRef { file: path.to_owned(), demo: *demo }).collect())
}

/// An episode of a run that was simulated again by its recorded actions.
#[derive(Debug)]
pub struct EpisodeReplay {
    pub index: EpisodeIndex,
    /// Record of the simulation. The fields of the policy are those of the recorded one.
    pub simulated: EpisodeRecord,
    /// First difference from the recorded one. `None` if they are byte-identical.
    pub difference: Option<String>,
    /// Its states, if they were asked for.
    pub recording: Option<StateRecording>,
}

/// Simulates an episode of a run again by its recorded actions. A judged run needs its `secret`.
///
/// # Errors
/// The run has no such episode, its scripts have changed since, its actions are damaged, or the episode cannot be run.
pub fn replay_episode(
    run: &StoredRun,
    episode: EpisodeSelector,
    secret: Option<&SecretFile>,
    keeps_states: bool,
    observer: Arc<dyn Observer>,
) -> Result<EpisodeReplay, RunError> {
    let record = episode.find_record(run)?;
    let index = record.header.id.index();
    let manifest = StoredManifest { path: &run.dir, manifest: &run.manifest, secret, observer };
    let actions = actions::read_checked(&run.dir, record)?;
    let FinishedEpisode { record: simulated, recording, .. } =
        manifest.simulate(record, actions, keeps_states)?;
    Ok(EpisodeReplay { index, difference: difference(record, &simulated)?, simulated, recording })
}

/// Simulates demonstrations again by their actions alone.
pub fn simulate_demos(demos: &[DemoRef], observer: &Arc<dyn Observer>) -> Result<Vec<DemoReplay>, RunError> {
    let mut replays: BTreeMap<usize, DemoReplay> = BTreeMap::new();
    parallel::run(
        demos.len(),
        thread_count(None),
        cancel::requested,
        |index| replay_demo(&demos[index], observer),
        |index, replay| {
            replays.insert(index, replay);
            Ok(())
        },
    )?;
    if cancel::requested() {
        return Err(RunError::interrupted("interrupted"));
    }
    Ok(replays.into_values().collect())
}

/// Simulates the episode of a demonstration with the controllers that `controllers` makes from its actions.
pub(crate) fn simulate_demo_with(
    demo: &DemoRef,
    observer: &Arc<dyn Observer>,
    controllers: impl FnOnce(Vec<Action>) -> ControllerFactory,
) -> Result<EpisodeRecord, RunError> {
    let file = TaskFile::open(&demo.file)?;
    let (record, manifest) = (file.record(demo.demo)?, recorded_manifest(&file)?);
    let stored =
        StoredManifest { path: &demo.file, manifest: &manifest, secret: None, observer: observer.clone() };
    Ok(stored.simulate_with(&record, controllers(file.actions(demo.demo)?), false)?.record)
}

fn replay_demo(demo: &DemoRef, observer: &Arc<dyn Observer>) -> Result<DemoReplay, RunError> {
    let record = TaskFile::open(&demo.file)?.record(demo.demo)?;
    let simulated = simulate_demo_with(demo, observer, |actions| replay_factory(actions, &record))?;
    let simulated = with_policy_fields(simulated, &record);
    Ok(DemoReplay {
        difference: difference(&record, &simulated)?,
        goal_reached: simulated.verdict.goal,
        state_hash: simulated.stats.state_hash,
    })
}
