//! [`RunConfig`]: the script of a run, changes of its scenes, policy, episodes and output.

use std::{
    collections::BTreeSet,
    fmt,
    io::{ErrorKind, Read},
    path::{Path, PathBuf},
    str::FromStr,
    sync::Arc,
};

use crate::{
    effect::differing_fields,
    episode_artifacts::EpisodeFilter,
    error::RunError,
    observer::{JobList, Observer, SilentObserver},
    policy::{PolicyConfig, PolicyOptions},
    stored_scripts::StoredScripts,
};
use softvt_benchmark::{
    ObjectType, Plan, ShiftValue, Suite,
    run_changes::{RunChanges, Twin},
    seed::SecretSeed,
};
use softvt_common::{cancel, parallel, text::counted};
use softvt_runs::shard::Shard;
use softvt_script::LoadedScript;

/// Detail of the trace of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceDetail {
    /// Poses, forces and deformation of every control step.
    State,
    /// The positions of all nodes too.
    Nodes,
}

impl FromStr for TraceDetail {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        match word {
            "state" => Ok(Self::State),
            "nodes" => Ok(Self::Nodes),
            _ => Err("expected state or nodes".to_owned()),
        }
    }
}

pub struct ConfiguredScript {
    /// The configuration from which the script was loaded.
    pub config: RunConfig,
    /// The script, loaded as the configuration says.
    pub script: LoadedScript,
}

impl ConfiguredScript {
    /// The script with another policy, which is loaded.
    ///
    /// # Errors
    /// A policy that cannot be loaded, or options for a plan without a policy.
    pub fn with_policy(self, options: &PolicyOptions) -> Result<Self, RunError> {
        if let plan @ Plan::Experiment { .. } = &self.script.plan {
            self.config.check_no_policy(options, plan_noun(plan))?;
        }
        Ok(Self { config: self.config.with_policy(PolicyConfig::load(options)?), ..self })
    }
}

/// Name of a plan in messages.
pub fn plan_noun(plan: &Plan) -> &'static str {
    let is_rigid = plan.suites().iter().all(|suite| suite.object_type == ObjectType::Rigid);
    match plan {
        Plan::Suite(_) if is_rigid => "a suite of rigid objects",
        Plan::Suite(_) => "a suite",
        Plan::Suites { .. } if is_rigid => "a list of suites of rigid objects",
        Plan::Suites { .. } => "a list of suites",
        Plan::Conditions { .. } => "a set of conditions",
        Plan::Experiment { .. } => "an experiment",
    }
}

/// Configuration of the runs of a script. The default runs the expert on all episodes of the suites as they are.
#[derive(Clone)]
pub struct RunConfig {
    /// The script, as messages name it.
    pub file: PathBuf,
    /// Values of the options that the script declares, as `--name=value`.
    pub options: Vec<String>,
    /// Base seed of a run without a secret; [`RunConfig::base_seed`] is that of every run.
    pub seed: u64,
    pub secret: Option<SecretSeed>,
    pub shifts: Vec<ShiftValue>,
    /// Changed settings by path and value.
    pub settings: Vec<(String, String)>,
    /// True if soft objects are made rigid.
    pub rigid_twin: bool,
    /// File with the ranges within which the episodes vary, in place of those of the suite.
    pub vary: Option<PathBuf>,
    pub policy: PolicyConfig,
    /// Indices or parts of prompts of the tasks to run; all if empty.
    pub tasks: Vec<String>,
    /// Episodes per task; by default the number that the suite states.
    pub episodes: Option<u32>,
    /// Only these episodes of each task; empty for the first [`episodes`](Self::episodes).
    pub selected_episodes: Vec<u32>,
    /// The part of the episodes to run; by default all.
    pub shard: Option<Shard>,
    /// Number of threads; results do not depend on it. By default that of the processors.
    pub threads: Option<u16>,
    /// Detail of the recorded control steps; by default none are recorded.
    pub trace: Option<TraceDetail>,
    /// Episodes that become videos.
    pub video: Option<EpisodeFilter>,
    /// Episodes that become MCAP files.
    pub mcap: Option<EpisodeFilter>,
    /// Folder of the results; by default nothing is written.
    pub out: Option<PathBuf>,
    /// True to write into the next folder `runs/SUITE-POLICY-NNN` if there is no output folder.
    pub is_numbered: bool,
    /// True to continue an interrupted run in the output folder.
    pub resume: bool,
    /// Scripts of a stored run, which are used in place of those on the disk.
    pub stored_scripts: Option<Arc<StoredScripts>>,
    pub observer: Arc<dyn Observer>,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self {
            file: PathBuf::new(),
            options: Vec::new(),
            seed: 0,
            secret: None,
            shifts: Vec::new(),
            settings: Vec::new(),
            rigid_twin: false,
            vary: None,
            policy: PolicyConfig::default(),
            tasks: Vec::new(),
            episodes: None,
            selected_episodes: Vec::new(),
            shard: None,
            threads: None,
            trace: None,
            video: None,
            mcap: None,
            out: None,
            is_numbered: false,
            resume: false,
            stored_scripts: None,
            observer: Arc::new(SilentObserver),
        }
    }
}

impl RunConfig {
    /// The script of a file, as it is.
    pub fn of(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), ..Self::default() }
    }

    pub fn with_policy(self, policy: PolicyConfig) -> Self {
        Self { policy, ..self }
    }

    /// Loads the script with its options, its variation and the secret.
    ///
    /// # Errors
    /// The script fails or returns no plan, or a field of the configuration has no effect on its plan.
    pub fn load(self) -> Result<ConfiguredScript, RunError> {
        let script = match &self.stored_scripts {
            Some(stored) => stored.load(&self.options)?,
            None => softvt_script::load(&self.file, &self.options)?,
        };
        let read = self.read_by(&script.plan);
        self.check_read(&read, plan_noun(&script.plan))?;
        Ok(ConfiguredScript { script: read.prepare_script(script)?, config: read })
    }

    /// The part of the configuration that a plan reads, with which it is run; the rest is at its defaults.
    fn read_by(&self, plan: &Plan) -> Self {
        let config = self.clone();
        let is_soft = |suite: &Suite| suite.object_type == ObjectType::Deformable;
        match plan {
            // It runs no episodes.
            Plan::Experiment { .. } => {
                let Self { file, options, seed, settings, threads, out, .. } = config;
                let Self { resume, stored_scripts, observer, .. } = config;
                let defaults = Self::default();
                Self {
                    file,
                    options,
                    seed,
                    settings,
                    threads,
                    out,
                    resume,
                    stored_scripts,
                    observer,
                    ..defaults
                }
            }
            _ => Self { rigid_twin: config.rigid_twin && plan.suites().iter().any(is_soft), ..config },
        }
    }

    /// Checks that the part `read` of the configuration is all that differs from the defaults. `user` names what reads
    /// it, as messages do.
    pub fn check_read(&self, read: &Self, user: impl fmt::Display) -> Result<(), RunError> {
        let unread = differing_fields!(
            self,
            read,
            Self {
                file, options, seed, secret, shifts, settings, rigid_twin, vary, tasks, episodes,
                selected_episodes, shard, threads, trace, video, mcap, out, resume;
                policy, is_numbered, stored_scripts, observer
            }
        );
        unread.first().map_or(Ok(()), |field| Err(self.no_effect(field, user)))
    }

    /// Checks that there are no options of a policy, since `user` has none.
    pub fn check_no_policy(&self, options: &PolicyOptions, user: impl fmt::Display) -> Result<(), RunError> {
        let given = options.differing(&PolicyOptions::default());
        given.first().map_or(Ok(()), |option| Err(self.no_effect(option, user)))
    }

    /// An error about a field or an argument that `user` does not read.
    pub fn no_effect(&self, field: &'static str, user: impl fmt::Display) -> RunError {
        self.error_of(field, "", format!("has no effect on {user}; leave it out"))
    }

    /// A loaded script with the secret, whose suites vary as the configuration says.
    pub(crate) fn prepare_script(&self, mut loaded: LoadedScript) -> Result<LoadedScript, RunError> {
        if let Some(file) = &self.vary {
            let (ranges, files) = softvt_script::load_variation(file)
                .map_err(|error| RunError::from(error).in_setting("vary", ""))?;
            if ranges.changes_nothing() {
                let file = file.display();
                self.notice(format_args!("warning: --vary {file}: all its factors are 1 and its largest changes 0, so that nothing varies"));
            }
            loaded.variation_files = files;
            loaded.vary(&ranges).map_err(|error| self.error_of("vary", "", error))?;
        }
        loaded.secret.clone_from(&self.secret);
        Ok(loaded)
    }

    /// Base seed of the run: the public seed of its secret, if it has one.
    pub fn base_seed(&self) -> u64 {
        self.secret.as_ref().map_or(self.seed, SecretSeed::public_seed)
    }

    /// The changes of the suite, as `run.json` states them.
    pub fn changes(&self) -> RunChanges {
        RunChanges {
            arguments: self.options.clone(),
            shifts: self.shifts.clone(),
            set: self.settings.clone(),
            twin: self.rigid_twin.then_some(Twin::Rigid),
            vary: self.vary.as_ref().map(|file| file.display().to_string()),
            seed: self.base_seed(),
            seed_hash: self.secret.as_ref().map(SecretSeed::hash),
        }
    }

    /// This configuration with the changes of another run. A judged run also needs its secret.
    pub(crate) fn with_changes(self, changes: RunChanges, secret: Option<SecretSeed>) -> Self {
        let rigid_twin = changes.is_rigid_twin();
        let RunChanges { arguments, shifts, set, twin: _, vary, seed, seed_hash: _ } = changes;
        let (options, settings, vary) = (arguments, set, vary.map(PathBuf::from));
        Self { options, shifts, settings, rigid_twin, vary, seed, secret, ..self }
    }

    pub fn error(&self, message: impl fmt::Display) -> RunError {
        RunError::input(message).at(self.file.display())
    }

    /// An error about a setting with this value, as [`RunError::of_setting`].
    pub(crate) fn error_of(
        &self,
        field: &'static str,
        value: impl ToString,
        message: impl ToString,
    ) -> RunError {
        RunError::of_setting(field, value, message).at(self.file.display())
    }

    /// Reports a message to the observer of the run.
    pub fn notice(&self, message: impl fmt::Display) {
        self.observer.notice(&message.to_string());
    }

    pub fn thread_count(&self) -> usize {
        thread_count(self.threads)
    }

    /// Runs the jobs `0..count` of a list on the threads of the configuration until one fails or a stop is requested.
    /// `finish` takes each result and returns the line of progress for the observer.
    pub(crate) fn run_jobs<T: Send>(
        &self,
        list: &JobList,
        count: usize,
        job: impl Fn(usize) -> Result<T, RunError> + Sync,
        mut finish: impl FnMut(usize, T) -> Result<String, RunError>,
    ) -> Result<(), RunError> {
        list.expect(count);
        parallel::run(count, self.thread_count(), cancel::requested, job, |number, result| {
            list.advance(&finish(number, result)?);
            Ok(())
        })
    }

    /// Begins a list of jobs for [`Self::run_jobs`].
    pub(crate) fn job_list(&self, what: &str) -> JobList<'_> {
        JobList::begin(&*self.observer, what)
    }

    /// Number of episodes per task of a suite.
    pub fn episodes_of(&self, suite: &Suite) -> u32 {
        match &self.selected_episodes[..] {
            [] => self.episodes.unwrap_or(suite.episodes),
            selected => selected.iter().collect::<BTreeSet<_>>().len() as u32,
        }
    }

    /// True if an episode of each task of a suite is run.
    pub(crate) fn runs_episode(&self, suite: &Suite, episode: u32) -> bool {
        match &self.selected_episodes[..] {
            [] => episode < self.episodes_of(suite),
            selected => selected.contains(&episode),
        }
    }

    pub fn suite_name(&self, suite: &Suite) -> String {
        self.changes().suite_name(&suite.name)
    }
}

/// Shortest seed file, bytes: a shorter one is easily guessed from its hash.
const MIN_SECRET_BYTES: usize = 16;
const MAX_SECRET_BYTES: u64 = 1 << 20;

/// The secret in a seed file.
///
/// # Errors
/// The file cannot be read, or has less than 16 bytes, so that its hash in the results would give it away.
pub fn read_secret(path: &Path) -> Result<SecretSeed, RunError> {
    let refuse = |what: String| RunError::of_setting("secret", path.display(), what);
    let make = "write one, for example: head -c 32 /dev/urandom > FILE";
    let mut content = Vec::new();
    // Devices such as /dev/urandom have no end.
    let read =
        std::fs::File::open(path).and_then(|file| file.take(MAX_SECRET_BYTES + 1).read_to_end(&mut content));
    read.map_err(|error| match error.kind() {
        ErrorKind::NotFound => refuse(format!("there is no such file; {make}")),
        _ => refuse(error.to_string()),
    })?;
    if content.len() as u64 > MAX_SECRET_BYTES {
        return Err(refuse(format!("it has more than {MAX_SECRET_BYTES} bytes; {make}")));
    }
    if content.len() < MIN_SECRET_BYTES {
        let bytes = counted(content.len(), "byte");
        return Err(refuse(format!("{bytes} may be guessed from their hash in the results; {make}")));
    }
    Ok(SecretSeed::new(&content))
}

/// Number of threads: the requested one, or that of the processors.
pub fn thread_count(requested: Option<u16>) -> usize {
    let available = || std::thread::available_parallelism().map_or(1, |n| n.get());
    requested.map_or_else(available, usize::from)
}
