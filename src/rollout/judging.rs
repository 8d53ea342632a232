//! The judge of an episode: what it must know of the settled scene.

use super::{
    evidence::{EvidenceCollector, lowest},
    simulation::{ObjectInstance, Simulation},
    spec::EpisodeSpec,
};
use crate::{
    benchmark::{Goal, control::steps_per_control},
    evaluation::{
        goal::GoalRegion,
        judge::{Judge, JudgeConfig},
    },
    geometry::{Aabb, Vec3},
    physics::BodyId,
};

/// The judge of an episode in its settled state.
pub(super) fn judge(
    spec: &EpisodeSpec,
    sim: &Simulation,
    evidence: &EvidenceCollector,
    (target, place): (usize, usize),
    hold_s: f64,
) -> Judge {
    Judge::new(JudgeConfig {
        criteria: spec.criteria.clone(),
        workspace: spec.scene.workspace,
        goal: place_of(&spec.task.goal, &sim.objects[place]),
        hold_s,
        dt_s: spec.params.dt,
        steps_per_control: steps_per_control(spec.params.dt),
        target_weight_n: weight(sim, target),
        is_target_soft: matches!(sim.objects[target].body, BodyId::Soft(_)),
        limit: spec.limit,
        target_lowest_z_w: lowest(sim, &sim.objects[target]),
        others_lowest_z_w: evidence.others_lowest(sim),
    })
}

/// Where the goal is, from the shape of what it names.
fn place_of(goal: &Goal, place: &ObjectInstance) -> GoalRegion {
    let bounds = place.bounds;
    match goal {
        Goal::On { .. } => GoalRegion::On { radius_m: 0.5 * bounds.size().xy().min() },
        Goal::In { .. } => {
            let wall = place.asset.hints.get("wall_m").copied().unwrap_or(0.0);
            let inset = Vec3::new(wall, wall, 0.0);
            let foot = place.foot_o();
            GoalRegion::In { inside: Aabb { min: bounds.min + inset - foot, max: bounds.max - inset - foot } }
        }
    }
}

fn weight(sim: &Simulation, object: usize) -> f64 {
    let mass = match sim.objects[object].body {
        BodyId::Soft(index) => sim.world.soft(index).state.model.total_mass(),
        BodyId::Rigid(index) => sim.world.rigid(index).state.mass,
        BodyId::Link(_) | BodyId::Kinematic(_) | BodyId::World => 0.0,
    };
    mass * sim.scene.gravity.norm()
}
