//! The specification of an episode: everything except its controller.

use std::sync::Arc;

use crate::{
    benchmark::{Task, seed::Split, settings::Settings},
    evaluation::{criteria::SuccessCriteria, record::Identity, safety::DeformationLimit},
    physics::PhysicsParams,
    robot::RobotSpec,
    scene::{Asset, Body, Scene},
    sensing::tactile::TactileSpec,
};

/// Identifies an episode of a task in a run.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeRef<'a> {
    /// Suite name.
    pub suite: &'a str,
    /// Index of the episode in its split.
    pub episode: u32,
    /// Seed of the run.
    pub seed: u64,
    /// List of episodes that `episode` counts in.
    pub split: Split,
    /// Policy name.
    pub policy: &'a str,
}

/// Specification of an episode: task, scene and parameters. The controller
/// is passed to [`Episode::run`](super::Episode::run).
#[derive(Clone, Debug)]
pub struct EpisodeSpec {
    /// Identity, as in results.
    pub identity: Identity,
    /// The task.
    pub task: Task,
    /// The scene, before settling.
    pub scene: Arc<Scene>,
    /// Deformation limit of the target; `None` if it was never calibrated.
    pub limit: Option<DeformationLimit>,
    /// Thresholds of the judge.
    pub criteria: SuccessCriteria,
    /// Parameters of the physics.
    pub params: PhysicsParams,
    /// Parameters of the robot.
    pub robot: RobotSpec,
    /// Parameters of the tactile sensors.
    pub tactile: TactileSpec,
    /// True to keep all states, from which images can be rendered after the episode.
    pub record_states: bool,
    /// True to keep a trace.
    pub record_trace: bool,
    /// True if traces hold the node positions of soft bodies.
    pub trace_nodes: bool,
}

impl EpisodeSpec {
    /// An episode of `task` in `scene`, without a limit, recording or trace. `nominal` is the scene before any shift;
    /// the identity of the episode names the asset that is the target there.
    pub fn new(
        episode: &EpisodeRef,
        task: &Task,
        nominal: &Scene,
        scene: Scene,
        settings: &Settings,
    ) -> Self {
        let target = target_asset(nominal, task);
        let identity = Identity {
            suite: episode.suite.to_owned(),
            task: task.id,
            prompt: task.prompt.clone(),
            layout: task.layout.clone(),
            episode: episode.episode,
            seed: episode.seed,
            split: episode.split.name().to_owned(),
            policy: episode.policy.to_owned(),
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
            record_trace: false,
            trace_nodes: false,
        }
    }
}

/// Asset of a task's target in a scene.
pub fn target_asset<'a>(scene: &'a Scene, task: &Task) -> Option<&'a Arc<Asset>> {
    let name = &task.goal.object;
    scene.objects.iter().find(|object| object.name == *name).map(|object| &object.asset)
}
