//! [`SuiteChecker`]: the scenes of the first episodes and the limits of a suite, without an episode.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::Mutex,
};

use crate::{
    config::{ConfiguredScript, RunConfig},
    episode_list::{EpisodeJob, EpisodeList},
    error::RunError,
    friction::{friction_warnings, layout_friction_warnings},
    suite_run::SuiteRun,
    suite_selection::select_episodes,
};
use softvt_benchmark::{ObjectType, ShiftValue, Suite, Task};
use softvt_common::{
    cancel,
    parallel::{self, lock},
    text::format_number,
};
use softvt_geometry::{Aabb, Vec3};
use softvt_rollout::{AssetCache, SensorAssets, scene_warnings};
use softvt_scene::{Body, Object, Scene};
use softvt_script::{EpisodeSetup, LoadedScript, SceneChanges};

/// Checks suites one after the other. Those that share assets load them once.
pub struct SuiteChecker<'a> {
    config: &'a RunConfig,
    script: &'a LoadedScript,
    assets: AssetCache,
    /// Fingerprints of the assets that have settled in a scene.
    settled: Mutex<BTreeSet<String>>,
    sensor_assets: SensorAssets,
}

impl<'a> SuiteChecker<'a> {
    /// A checker for the suites of a script.
    pub fn new(ConfiguredScript { config, script }: &'a ConfiguredScript) -> Self {
        let (assets, sensor_assets) = (AssetCache::approximate(), SensorAssets::default());
        Self { config, script, assets, settled: Mutex::default(), sensor_assets }
    }

    /// Builds and checks the scenes of the first episodes of every task on all processors, lets the objects settle,
    /// each asset once and by its approximate model, gives their warnings to `warn`, and reads the limits of their
    /// objects. Nothing is rendered.
    ///
    /// # Errors
    /// A setting, a scene, a sensor or a calibration file that is not valid; an object that does not come to rest; a
    /// request to stop.
    pub fn check(&self, suite: &Suite, episodes: u32, mut warn: impl FnMut(String)) -> Result<(), RunError> {
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
        let mut found = check_scenes(&run, &jobs)?;
        found.warnings.extend(changing_defaults(&run, &jobs)?);
        let settled = self.settle(&run, &jobs, std::mem::take(&mut found.scenes));
        self.config.observer.end();
        // First, since they may say why an object does not come to rest.
        found.warnings.into_iter().for_each(&mut warn);
        settled?.into_iter().for_each(&mut warn);
        let run = SuiteRun { jobs: select_episodes(self.config, suite, &tasks), ..run };
        let judged = run.scan_limits()?.judged;
        for asset in found.without_strain.intersection(&judged) {
            warn(format!(
                "asset {asset}: its material has neither collapse_strain nor damage_strain, so that its limit says where the press \
                 ended, not what the material bears"
            ));
        }
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

/// Warnings and assets from the scenes of a suite.
#[derive(Default)]
struct SceneFindings {
    warnings: BTreeSet<String>,
    /// Names of the soft assets whose material has no strain limit.
    without_strain: BTreeSet<String>,
    /// Positions of the objects in the scene of each layout, without shifts, m.
    layouts: BTreeMap<LayoutOfTask, BTreeMap<String, Vec3>>,
    /// True if shifts change a scene or a prompt.
    has_changed: bool,
    /// The scenes, in the order of their jobs.
    scenes: Vec<Scene>,
}

/// A layout in an episode of a task.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct LayoutOfTask {
    layout: String,
    episode: u32,
    task: usize,
}

/// Distance of places that count as the same, m.
const SAME_PLACE_M: f64 = 1e-6;

fn check_scenes(run: &SuiteRun, jobs: &EpisodeList) -> Result<SceneFindings, RunError> {
    let mut all = SceneFindings::default();
    let check_scene = |EpisodeJob { task, episode }: EpisodeJob| -> Result<SceneFindings, RunError> {
        let setup = run.open_episode(&run.episode_id(task, episode))?;
        let mut warnings = scene_warnings(task, &setup.scene, &run.assets);
        warnings.extend(friction_warnings(run, task, &setup));
        warnings.extend(layout_friction_warnings(run, &setup));
        let of_task = |warning: String| format!("task {}: {warning}", task.id);
        if !run.config.rigid_twin {
            warnings.extend(no_soft_target(run.suite, task, &setup.scene).map(of_task));
        }
        let has_changed = setup.is_shifted();
        let objects = setup.nominal.objects.iter();
        let positions =
            objects.map(|object| (object.name.clone(), object.pose_w.translation.vector)).collect();
        let placed_by = LayoutOfTask { layout: task.layout.clone(), episode, task: task.id };
        let layouts = [(placed_by, positions)].into();
        let soft = setup.scene.objects.iter().filter_map(|object| match &object.asset.body {
            Body::Soft(material) => Some((material, &object.asset.name)),
            _ => None,
        });
        let without_strain = soft.filter(|(material, _)| material.stable_strain().is_none());
        let without_strain = without_strain.map(|(_, name)| name.clone()).collect();
        let of_scene = run.check_scene(task, episode, setup.scene.clone(), setup.predicates)?;
        warnings.extend(of_scene.into_iter().map(of_task));
        Ok(SceneFindings { warnings, without_strain, layouts, has_changed, scenes: vec![setup.scene] })
    };
    let check = |position: usize| {
        let job = jobs.job(position);
        check_scene(job).map_err(|error| match job.episode {
            0 => error,
            episode => error.within(&format!("task {} episode {episode}", job.task.id)),
        })
    };
    parallel::run_in_order(jobs.len(), run.config.thread_count(), cancel::requested, check, |_, found| {
        all.warnings.extend(found.warnings);
        all.without_strain.extend(found.without_strain);
        all.has_changed |= found.has_changed;
        all.layouts.extend(found.layouts);
        all.scenes.extend(found.scenes);
        Ok(())
    })?;
    all.warnings.extend(layout_conflicts(&all.layouts));
    if !all.has_changed && !jobs.is_empty() {
        run.refuse_shifts_without_effect()?;
    }
    Ok(all)
}

/// Warnings about layouts of two tasks with the same name that place an object differently.
fn layout_conflicts(layouts: &BTreeMap<LayoutOfTask, BTreeMap<String, Vec3>>) -> Vec<String> {
    let mut warnings = Vec::new();
    for ((one, places), (other, other_places)) in layouts.iter().zip(layouts.iter().skip(1)) {
        if one.layout != other.layout || one.episode != other.episode {
            continue;
        }
        let is_elsewhere = |(name, at): &(&String, &Vec3)| {
            other_places.get(*name).is_some_and(|other_at| (other_at - *at).norm() > SAME_PLACE_M)
        };
        if let Some((name, _)) = places.iter().find(is_elsewhere) {
            warnings.push(format!(
                "tasks {} and {}: both layouts have the name {:?}, and place {name} differently; tasks with the same layout share \
                 their initial states, so give these two names",
                one.task, other.task, one.layout
            ));
        }
    }
    warnings
}

/// Warnings about shifts of a suite that change its first scene though they have their default value.
fn changing_defaults(run: &SuiteRun, jobs: &EpisodeList) -> Result<Vec<String>, RunError> {
    let mut warnings = Vec::new();
    if jobs.is_empty() {
        return Ok(warnings);
    }
    let EpisodeJob { task, episode } = jobs.job(0);
    for shift in &run.suite.shifts {
        let value = ShiftValue { name: shift.name.clone(), value: shift.default };
        let changes = SceneChanges { shifts: vec![value], ..run.changes() };
        let setup = EpisodeSetup::open(run.loaded, &run.episode_id(task, episode), &changes)?;
        if setup.is_shifted() {
            warnings.push(format!(
                "shift {}: its default, {}, changes the scene; give the value that changes nothing",
                shift.name,
                format_number(shift.default)
            ));
        }
    }
    Ok(warnings)
}

/// A warning about a task of a suite of soft objects whose goal moves none.
fn no_soft_target(suite: &Suite, task: &Task, scene: &Scene) -> Option<String> {
    let targets = task.targets();
    let mut moved = scene.objects.iter().filter(|object| targets.contains(&object.name.as_str()));
    let is_judged = suite.object_type == ObjectType::Rigid
        || moved.any(|object| matches!(object.asset.body, Body::Soft(_)));
    (!is_judged).then(|| {
        format!(
            "its goal moves no soft object, only {}, so that no deformation is judged",
            targets.join(", ")
        )
    })
}
