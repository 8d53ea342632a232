//! The golden episode, whose final state is published: a machine that ends in another computes other results.

use std::sync::Arc;

use serde::Deserialize;

use super::{
    config::{ConfiguredScript, RunConfig},
    episode_list::{EpisodeJob, EpisodeList},
    error::RunError,
    observer::Observer,
    suite_run::SuiteRun,
};
use softvt_benchmark::Plan;
use softvt_common::episode_id::EpisodeSplit;

/// `assets/golden.json`: an episode and its final state.
#[derive(Clone, Debug, Deserialize)]
pub struct GoldenEpisode {
    pub script: String,
    pub task: usize,
    pub state_hash: String,
}

impl GoldenEpisode {
    /// The published one; `None` in a build without it.
    pub fn published() -> Result<Option<Self>, RunError> {
        let file = softvt_script::embedded("assets/golden.json");
        Ok(file.map(serde_json::from_slice).transpose()?)
    }

    /// Simulates the episode and returns the hash of its final state. Writes nothing.
    ///
    /// # Errors
    /// The episode cannot be run, for example since a file of the working folder replaces one of the release.
    pub fn simulate(&self, observer: Arc<dyn Observer>) -> Result<String, RunError> {
        let loaded = RunConfig { observer, ..RunConfig::of(&self.script) }.load()?;
        let ConfiguredScript { config, script } = &loaded;
        let Plan::Suite(suite) = &script.plan else { return Err(config.error("is not a suite")) };
        let task = suite.tasks.iter().find(|task| task.id == self.task);
        let task = task.ok_or_else(|| config.error(format_args!("has no task {}", self.task)))?;
        let job = EpisodeJob { task, episode: 0 };
        let run =
            SuiteRun::new(config, script, suite, EpisodeList::listed(vec![job]), EpisodeSplit::Validation)?;
        Ok(run.run_episode(job, false, &run.controllers)?.record.stats.state_hash)
    }
}
