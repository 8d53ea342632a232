//! The specification of an episode: everything except its controller.

use std::sync::Arc;

use crate::{
    benchmark::{Task, settings::Settings},
    evaluation::{
        criteria::SuccessCriteria, episode_id::EpisodeId, record::EpisodeHeader, safety::DeformationLimit,
    },
    physics::PhysicsParams,
    robot::RobotSpec,
    scene::{Asset, Body, Scene},
    sensing::tactile::TactileSpec,
};

/// Specification of an episode: task, scene and parameters. The controller
/// is passed to [`Episode::run`](super::Episode::run).
#[derive(Clone, Debug)]
pub struct EpisodeSpec {
    /// First columns of its record.
    pub header: EpisodeHeader,
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
    /// the header names the asset that is the target there.
    pub fn new(
        id: EpisodeId,
        policy: &str,
        task: &Task,
        nominal: &Scene,
        scene: Scene,
        settings: &Settings,
    ) -> Self {
        let target = target_asset(nominal, task);
        let header = EpisodeHeader {
            id,
            prompt: task.prompt.clone(),
            layout: task.layout.clone(),
            policy: policy.to_owned(),
            privileged: false,
            soft: target.is_some_and(|asset| matches!(asset.body, Body::Soft(_))),
            asset: target.map_or(String::new(), |asset| asset.name.clone()),
            origin: None,
        };
        Self {
            header,
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
