//! The goal of a task in a scene: its objects and its region.

use super::{
    asset_cache::AssetCache,
    episode::EpisodeError,
    evidence::foot_pose,
    simulation::{ObjectInstance, Simulation, placed_at},
};
use softvt_benchmark::{GoalKind, Task};
use softvt_evaluation::goal::GoalRegion;
use softvt_geometry::Aabb;

/// The goal of a task in a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct GoalInScene {
    /// Index of the object to be moved.
    pub object: usize,
    /// Index of the object that must carry it.
    pub target: usize,
    /// Region in the frame of the latter.
    pub region: GoalRegion,
}

impl GoalInScene {
    /// The goal of a task. The scene need not have settled.
    ///
    /// # Errors
    /// The goal names an unknown object or a container without a cavity, or gravity does not point down.
    pub(super) fn find(task: &Task, sim: &Simulation, cache: &AssetCache) -> Result<Self, EpisodeError> {
        let find = |role, name: &str| {
            sim.objects.iter().position(|o| o.name == name).ok_or_else(|| EpisodeError::NoObject {
                task: task.id,
                role,
                name: name.to_owned(),
                layout: task.layout.clone(),
                have: sim.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>().join(", "),
            })
        };
        let (object, target) = (find("object", &task.goal.object)?, find("target", &task.goal.target)?);
        let region = goal_region(task.goal.kind, &sim.objects[target], cache).ok_or_else(|| {
            let (name, placed_at) = (task.goal.target.clone(), placed_at(&sim.scene, &task.goal.target));
            EpisodeError::NoCavity { task: task.id, target: name, placed_at }
        })?;
        if sim.scene.gravity.z >= 0.0 {
            return Err(EpisodeError::Gravity {
                task: task.id,
                object: task.goal.object.clone(),
                gravity: sim.scene.gravity,
                placed_at: placed_at(&sim.scene, &task.goal.object),
            });
        }
        Ok(Self { object, target, region })
    }

    /// True if the object is over the region, at any height: the goal may hold once the scene has settled.
    pub(super) fn is_object_over(&self, sim: &Simulation) -> bool {
        let [object, target] = [self.object, self.target].map(|index| &sim.objects[index]);
        self.region.is_over(&foot_pose(sim, target), &sim.centre(object))
    }
}

/// Checks the goal of a task in a scene that need not have settled. Returns true if the goal may hold once it has.
///
/// # Errors
/// The goal names an unknown object or a container without a cavity, or gravity does not point down.
pub fn check_goal(task: &Task, sim: &Simulation, cache: &AssetCache) -> Result<bool, EpisodeError> {
    Ok(GoalInScene::find(task, sim, cache)?.is_object_over(sim))
}

/// Region in which the object must rest, in the frame of the target at its foot. `None` for `Inside` an object without
/// a cavity.
fn goal_region(kind: GoalKind, target: &ObjectInstance, cache: &AssetCache) -> Option<GoalRegion> {
    match kind {
        GoalKind::On => Some(GoalRegion::On { radius_m: 0.5 * target.bounds.size().xy().min() }),
        GoalKind::Inside => {
            let Aabb { min, max } = cache.cavity(&target.asset.shape)?;
            let foot = target.foot_o();
            Some(GoalRegion::Inside { space: Aabb { min: min - foot, max: max - foot } })
        }
    }
}
