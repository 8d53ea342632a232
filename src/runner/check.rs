//! [`SuiteChecker`]: the scenes of the first episodes and the limits of a suite, without an episode.

use std::{collections::BTreeSet, sync::Mutex};

use crate::{
    config::{ConfiguredScript, RunConfig},
    episode_list::{EpisodeJob, EpisodeList},
    error::RunError,
    suite_run::SuiteRun,
    suite_selection::select_episodes,
};
use softvt_benchmark::{ObjectType, Suite, Task};
use softvt_common::{
    cancel,
    episode_id::EpisodeSplit,
    parallel::{self, lock},
};
use softvt_geometry::Aabb;
use softvt_rollout::scene_warnings;
use softvt_scene::{Body, Object, Scene};
use softvt_script::LoadedScript;

/// Checks suites one after the other. Those that share assets load them once.
pub struct SuiteChecker<'a> {
    config: &'a RunConfig,
    script: &'a LoadedScript,
    /// Fingerprints of the assets that have settled in a scene.
    settled: Mutex<BTreeSet<String>>,
}

impl<'a> SuiteChecker<'a> {
    /// A checker for the suites of a script.
    pub fn new(ConfiguredScript { config, script }: &'a ConfiguredScript) -> Self {
        Self { config, script, settled: Mutex::default() }
    }

    /// Builds and checks the scenes of the first episodes of every task on all processors, lets the objects settle,
    /// each asset once and by its approximate model, gives their warnings to `warn`, and reads the limits of their
    /// objects. Nothing is rendered.
    ///
    /// # Errors
    /// A setting, a scene, a sensor or a calibration file that is not valid; an object that does not come to rest;
    /// a request to stop.
    pub fn check(&self, suite: &Suite, episodes: u32, mut warn: impl FnMut(String)) -> Result<(), RunError> {
        self.config.observer.work(&format!("checking {}", suite.name));
        let tasks: Vec<&Task> = suite.tasks.iter().collect();
        // Without episodes, a run whose actions are repeated may have fewer of them than the suite.
        let none = EpisodeList::listed(Vec::new());
        let run = SuiteRun {
            assets: self.script.sources.assets.approximate(),
            ..SuiteRun::new(self.config, self.script, suite, none, EpisodeSplit::Validation)?
        };
        let jobs = EpisodeList::of_tasks(&tasks, episodes, None);
        let CheckedScenes { warnings, scenes } = check_scenes(&run, &jobs)?;
        let settled = self.settle(&run, &jobs, scenes);
        self.config.observer.end();
        // First, since they may say why an object does not come to rest.
        warnings.into_iter().for_each(&mut warn);
        settled?.into_iter().for_each(&mut warn);
        let run = SuiteRun { jobs: select_episodes(self.config, suite, &tasks), ..run };
        run.scan_limits()?;
        if cancel::requested() { Err(RunError::interrupted("interrupted")) } else { Ok(()) }
    }
}

impl SuiteChecker<'_> {
    /// Lets the objects of scenes settle whose assets have not settled before, with what supports them. Returns
    /// warnings about those that tilt.
    fn settle(
        &self,
        run: &SuiteRun,
        jobs: &EpisodeList,
        scenes: Vec<Scene>,
    ) -> Result<BTreeSet<String>, RunError> {
        let mut settled = lock(&self.settled);
        let scenes = scenes.into_iter().map(|scene| Self::with_new_objects(scene, &mut settled));
        let scenes: Vec<(usize, Scene)> = scenes.enumerate().filter_map(|(at, s)| Some((at, s?))).collect();
        let settle = |index: usize| {
            let (position, scene) = &scenes[index];
            run.settle_scene(jobs.job(*position), scene)
        };
        let mut warnings = BTreeSet::new();
        parallel::run(scenes.len(), run.config.thread_count(), cancel::requested, settle, |_, found| {
            warnings.extend(found);
            Ok(())
        })?;
        Ok(warnings)
    }

    /// The scene without the movable objects whose assets are in `settled`, unless they may support another. Adds the
    /// assets of those that it has. `None` if it has none.
    fn with_new_objects(mut scene: Scene, settled: &mut BTreeSet<String>) -> Option<Scene> {
        let is_movable = |object: &Object| matches!(object.asset.body, Body::Rigid { .. } | Body::Soft(_));
        let box_w = |object: &Object| object.asset.shape.loose_bounds().transformed(&object.pose_w);
        let overlaps = |a: &Aabb, b: &Aabb| (0..2).all(|i| a.min[i] <= b.max[i] && b.min[i] <= a.max[i]);
        let movable = || scene.objects.iter().filter(|object| is_movable(object));
        let boxes: Vec<Aabb> = movable().map(box_w).collect();
        let mut kept: Vec<bool> =
            movable().map(|object| settled.insert(object.nominal.fingerprint())).collect();
        if !kept.contains(&true) {
            return None;
        }
        // Keeps the objects that may support a kept one, and those that may support them.
        loop {
            let supports =
                |own: &Aabb| boxes.iter().zip(&kept).any(|(other, kept)| *kept && overlaps(own, other));
            let next: Vec<bool> = boxes.iter().map(supports).collect();
            if next == kept {
                break;
            }
            kept = next;
        }
        let mut kept = kept.into_iter();
        scene.objects.retain(|object| !is_movable(object) || kept.next() == Some(true));
        Some(scene)
    }
}

/// The scenes of a suite, in the order of their jobs, and warnings about them.
#[derive(Default)]
struct CheckedScenes {
    warnings: BTreeSet<String>,
    scenes: Vec<Scene>,
}

fn check_scenes(run: &SuiteRun, jobs: &EpisodeList) -> Result<CheckedScenes, RunError> {
    let check = |position: usize| -> Result<(Scene, BTreeSet<String>, bool), RunError> {
        let EpisodeJob { task, episode } = jobs.job(position);
        let setup = run.open_episode(&run.episode_id(task, episode))?;
        let judges_soft = run.suite.object_type != ObjectType::Rigid && !run.config.rigid_twin;
        let mut warnings = scene_warnings(task, &setup.scene, judges_soft, &run.assets);
        warnings.extend(run.ineffective_friction(&setup));
        warnings.extend(setup.unusual_numbers());
        let has_changed = setup.is_shifted();
        let of_scene = run.check_scene(task, episode, setup.scene.clone(), setup.predicates)?;
        warnings.extend(of_scene.into_iter().map(|warning| format!("task {}: {warning}", task.id)));
        Ok((setup.scene, warnings, has_changed))
    };
    let check_job = |position: usize| {
        let EpisodeJob { task, episode } = jobs.job(position);
        check(position).map_err(|error| match episode {
            0 => error,
            episode => error.within(&format!("task {} episode {episode}", task.id)),
        })
    };
    let (mut all, mut has_changed) = (CheckedScenes::default(), jobs.is_empty());
    parallel::run_in_order(
        jobs.len(),
        run.config.thread_count(),
        cancel::requested,
        check_job,
        |_, found| {
            let (scene, warnings, is_shifted) = found;
            all.warnings.extend(warnings);
            all.scenes.push(scene);
            has_changed |= is_shifted;
            Ok(())
        },
    )?;
    if !has_changed {
        run.refuse_shifts_without_effect()?;
    }
    Ok(all)
}
