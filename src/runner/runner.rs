//! [`Runner`]: the suites of a script under a policy.

use std::{
    borrow::Cow,
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::{
    config::{ConfiguredScript, RunConfig, TraceDetail},
    episode_artifacts::EpisodeFilter,
    error::RunError,
    evaluate::{SuiteResult, run_episodes, run_suite},
    observer::Observer,
    policy::PolicyConfig,
    suite_run::SuiteRun,
    suite_selection::{check_episodes, check_parent_folder, next_run_dir, run_dir, select_suites},
};
use softvt_benchmark::{Plan, ShiftValue};
use softvt_runs::{record::EpisodeRecord, shard::Shard};
use softvt_script::LoadedScript;

/// Runs the suites of a loaded script. Without an output folder, nothing is written.
///
/// ```
/// use softvt_runner::{PolicyConfig, RunConfig, Runner};
///
/// let loaded = RunConfig::of("suites/spatial_soft.lua").load()?;
/// let results = Runner::new(&loaded).policy(PolicyConfig::named("noop")?).tasks(["0"]).episodes(1).run(|_| ())?;
/// assert_eq!(results[0].records.len(), 1);
/// assert!(!results[0].records[0].verdict.goal);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Runner<'a> {
    script: Cow<'a, LoadedScript>,
    config: RunConfig,
    is_numbered: bool,
}

impl<'a> Runner<'a> {
    /// The episodes of a configuration.
    pub fn new(loaded: &'a ConfiguredScript) -> Self {
        Self { script: Cow::Borrowed(&loaded.script), config: loaded.config.clone(), is_numbered: false }
    }

    fn change(mut self, change: impl FnOnce(&mut RunConfig)) -> Self {
        change(&mut self.config);
        self
    }

    /// Another policy than that of the configuration.
    pub fn policy(self, policy: PolicyConfig) -> Self {
        self.change(|config| config.policy = policy)
    }

    /// Only these tasks: indices or parts of prompts.
    pub fn tasks<T: ToString>(self, tasks: impl IntoIterator<Item = T>) -> Self {
        self.change(|config| config.tasks = tasks.into_iter().map(|task| task.to_string()).collect())
    }

    /// Episodes per task.
    pub fn episodes(self, count: u32) -> Self {
        self.change(|config| config.episodes = Some(count))
    }

    /// Base seed. That of a secret stays.
    pub fn seed(self, seed: u64) -> Self {
        self.change(|config| config.seed = seed)
    }

    /// A shift of the suite with its value, in addition to those of the configuration.
    pub fn shift(self, name: &str, value: f64) -> Self {
        self.change(|config| config.shifts.push(ShiftValue { name: name.to_owned(), value }))
    }

    /// A changed setting, by path and value, in addition to those of the configuration.
    pub fn set(self, path: &str, value: impl ToString) -> Self {
        self.change(|config| config.settings.push((path.to_owned(), value.to_string())))
    }

    /// The rigid twin of the suites: soft objects are made rigid.
    pub fn rigid_twin(self) -> Self {
        self.change(|config| config.rigid_twin = true)
    }

    /// The suites varied within the ranges of a file, in place of their own.
    ///
    /// # Errors
    /// A variation that is not valid, or does not fit a suite.
    pub fn vary(self, file: impl AsRef<Path>) -> Result<Self, RunError> {
        let varied = self.change(|config| config.vary = Some(file.as_ref().to_owned()));
        let script = varied.config.prepare_script(varied.script.into_owned())?;
        Ok(Self { script: Cow::Owned(script), ..varied })
    }

    /// Writes the true state after every control step into the output folder.
    pub fn trace(self, detail: TraceDetail) -> Self {
        self.change(|config| config.trace = Some(detail))
    }

    /// Renders videos of these episodes into the output folder.
    pub fn video(self, episodes: EpisodeFilter) -> Self {
        self.change(|config| config.video = Some(episodes))
    }

    /// Writes these episodes as MCAP files for Foxglove and Rerun into the output folder.
    pub fn mcap(self, episodes: EpisodeFilter) -> Self {
        self.change(|config| config.mcap = Some(episodes))
    }

    /// Only one part of the episodes.
    pub fn shard(self, shard: Shard) -> Self {
        self.change(|config| config.shard = Some(shard))
    }

    /// Number of threads; results do not depend on it.
    pub fn threads(self, count: u16) -> Self {
        self.change(|config| config.threads = Some(count))
    }

    /// Folder of the run, or of one run per suite for a list of suites.
    pub fn out(self, folder: impl Into<PathBuf>) -> Self {
        self.change(|config| config.out = Some(folder.into()))
    }

    /// Continues an interrupted run in the output folder.
    pub fn resume(self) -> Self {
        self.change(|config| config.resume = true)
    }

    /// Receiver of progress and messages.
    pub fn observer(self, observer: Arc<dyn Observer>) -> Self {
        self.change(|config| config.observer = observer)
    }

    /// Writes into the next folder `runs/SUITE-POLICY-NNN` of the working folder if there is no output folder.
    pub fn numbered(self) -> Self {
        Self { is_numbered: true, ..self }
    }

    /// Runs the episodes, and calls `on_episode` for each one that it has run, in the order in which they end. Returns
    /// the results of each suite, with the episodes that the output folder had before.
    ///
    /// # Errors
    /// The script has no suite; a scene, a setting or the policy is not valid; a folder contains something else; a
    /// trace, videos, MCAP files or a resumed run without an output folder; or a request to stop. Finished episodes are
    /// kept in the output folder.
    pub fn run(&self, mut on_episode: impl FnMut(&EpisodeRecord)) -> Result<Vec<SuiteResult>, RunError> {
        let (config, plan) = (&self.config, &self.script.plan);
        let is_list = matches!(plan, Plan::Suites { .. });
        let suites = select_suites(config, plan)?;
        let needs_folder =
            config.trace.is_some() || config.video.is_some() || config.mcap.is_some() || config.resume;
        if needs_folder && config.out.is_none() && !self.is_numbered {
            return Err(config.error("a trace, videos, MCAP files and a resumed run need an output folder"));
        }
        check_episodes(config, suites)?;
        if is_list {
            check_parent_folder(config)?;
        }
        let mut results = Vec::new();
        for suite in suites {
            let numbered = || self.is_numbered.then(|| next_run_dir(config, &config.suite_name(suite)));
            let out = run_dir(config, suite, is_list).or_else(numbered);
            let has_folder = out.is_some();
            let run = SuiteRun::selected(config, &self.script, suite, out)?.prepare()?;
            results.push(match has_folder {
                true => run_suite(&run, &mut on_episode)?,
                false => run_episodes(&run, &mut on_episode)?,
            });
        }
        Ok(results)
    }
}
