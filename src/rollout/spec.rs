//! Everything about an episode but who drives.

use std::sync::Arc;

use crate::{
    benchmark::{Task, seed::Split, settings::Settings},
    evaluation::{criteria::SuccessCriteria, record::Identity, safety::DeformationLimit},
    physics::PhysicsParams,
    robot::RobotSpec,
    scene::{Asset, Body, Scene},
    sensing::tactile::TactileSpec,
};

/// Which episode of a task, in which run.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeRef<'a> {
    /// Suite name.
    pub suite: &'a str,
    /// Index of the episode in its split.
    pub episode: u32,
    /// Seed of the run.
    pub seed: u64,
    /// Which list of episodes.
    pub split: Split,
    /// Policy name.
    pub policy: &'a str,
}

/// Everything about an episode but who drives.
#[derive(Clone, Debug)]
pub struct EpisodeSpec {
    /// Which one it is.
    pub identity: Identity,
    /// The task.
    pub task: Task,
    /// The scene before settling.
    pub scene: Arc<Scene>,
    /// Deformation limit by asset name; `None` if the target was never calibrated.
    pub limit: Option<DeformationLimit>,
    /// Judging thresholds.
    pub criteria: SuccessCriteria,
    /// Parameters of the mechanics.
    pub params: PhysicsParams,
    /// Parameters of the robot.
    pub robot: RobotSpec,
    /// Parameters of the tactile sensors.
    pub tactile: TactileSpec,
    /// Whether to keep what is needed to draw the rollout later.
    pub record_states: bool,
    /// Whether to keep a trace, and whether with node positions.
    pub trace: Option<bool>,
}

impl EpisodeSpec {
    /// An episode of `task` in `scene`, without limit, film and trace. `nominal` is the scene before any shift: an episode
    /// is told by the asset that its layout made the target.
    pub fn new(
        which: &EpisodeRef,
        task: &Task,
        (nominal, scene): (&Scene, Scene),
        settings: &Settings,
    ) -> Self {
        let target = target_asset(nominal, task);
        let identity = Identity {
            suite: which.suite.to_owned(),
            task: task.id,
            prompt: task.prompt.clone(),
            layout: task.layout.clone(),
            episode: which.episode,
            seed: which.seed,
            split: which.split.name().to_owned(),
            policy: which.policy.to_owned(),
            privileged: false,
            soft: target.is_some_and(|asset| matches!(asset.body, Body::Soft(_))),
            asset: target.map_or(String::new(), |asset| asset.name.clone()),
            origin: None,
        };
        Self {
            identity,
            task: task.clone(),
            scene: Arc::new(scene),
            limit: None,
            criteria: settings.criteria.clone(),
            params: settings.physics.clone(),
            robot: settings.robot.clone(),
            tactile: settings.tactile.clone(),
            record_states: false,
            trace: None,
        }
    }
}

/// The asset of a task's target in a scene.
pub fn target_asset<'a>(scene: &'a Scene, task: &Task) -> Option<&'a Arc<Asset>> {
    let name = task.goal.object();
    scene.objects.iter().find(|object| object.name == name).map(|object| &object.asset)
}
