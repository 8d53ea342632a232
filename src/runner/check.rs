//! [`SuiteChecker`]: the scenes of the first episodes and the limits of a suite, without an episode.

use std::{collections::BTreeSet, path::PathBuf};

use crate::{
    config::{ConfiguredScript, RunConfig},
    episode_list::{EpisodeJob, EpisodeList},
    error::RunError,
    scene_pool::ScenePool,
    selection::select_episodes,
    suite_run::SuiteRun,
};
use softvt_benchmark::{Suite, Task};
use softvt_common::{cancel, parallel};
use softvt_rollout::{AssetCache, SensorAssets, scene_warnings};
use softvt_script::LoadedScript;

/// Checks suites one after the other. Those that share assets load them once.
pub struct SuiteChecker<'a> {
    config: &'a RunConfig,
    script: &'a LoadedScript,
    scenes: ScenePool<'a>,
    assets: AssetCache,
    sensor_assets: SensorAssets,
}

impl<'a> SuiteChecker<'a> {
    /// A checker for the suites of a script.
    pub fn new(ConfiguredScript { config, script }: &'a ConfiguredScript) -> Self {
        let (assets, sensor_assets) = (AssetCache::approximate(), SensorAssets::default());
        Self { config, script, scenes: ScenePool::new(script), assets, sensor_assets }
    }

    /// Builds and checks the scenes of the first episodes of every task on all processors, gives their warnings to
    /// `warn`, and reads the limits of their objects. Nothing is rendered; a scene settles only if its goal may hold at
    /// the start.
    ///
    /// # Errors
    /// A setting, a scene, a sensor or a calibration file that is not valid; a request to stop.
    pub fn check(&self, suite: &Suite, episodes: u32, warn: impl FnMut(String)) -> Result<(), RunError> {
        self.config.observer.work(&format!("checking {}", suite.name));
        let tasks: Vec<&Task> = suite.tasks.iter().collect();
        // Without episodes, a run whose actions are repeated may have fewer of them than the suite.
        let none = EpisodeList::listed(Vec::new());
        let run = SuiteRun {
            assets: self.assets.clone(),
            sensor_assets: self.sensor_assets.clone(),
            ..SuiteRun::new(self.config, self.script, suite, none, PathBuf::new())?
        };
        let jobs = EpisodeList::of_tasks(&tasks, episodes, None);
        let warnings = check_scenes(&run, &self.scenes, &jobs)?;
        self.config.observer.end();
        warnings.into_iter().for_each(warn);
        SuiteRun { jobs: select_episodes(self.config, suite, &tasks), ..run }.scan_limits(&self.scenes)?;
        if cancel::requested() { Err(RunError::interrupted("interrupted")) } else { Ok(()) }
    }
}

fn check_scenes(
    run: &SuiteRun,
    scenes: &ScenePool,
    jobs: &EpisodeList,
) -> Result<BTreeSet<String>, RunError> {
    let mut warnings = BTreeSet::new();
    let check_scene = |EpisodeJob { task, episode }: EpisodeJob| -> Result<BTreeSet<String>, RunError> {
        let setup =
            scenes.with(|builder| builder.build(&run.episode_id(task, episode), &run.changes()))??;
        let mut warnings = scene_warnings(task, &setup.scene, &run.assets);
        let of_task = |warning: String| format!("task {}: {warning}", task.id);
        warnings.extend(run.check_scene(task, episode, setup.scene, setup.predicates)?.map(of_task));
        Ok(warnings)
    };
    let check = |position: usize| {
        let job = jobs.job(position);
        check_scene(job).map_err(|error| match job.episode {
            0 => error,
            episode => error.within(&format!("task {} episode {episode}", job.task.id)),
        })
    };
    parallel::run(jobs.len(), run.config.thread_count(), cancel::requested, check, |_, found| {
        warnings.extend(found);
        Ok(())
    })?;
    Ok(warnings)
}
