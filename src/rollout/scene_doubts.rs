//! Scenes that are valid and most likely not what their author means.

use std::collections::BTreeSet;

use softvt_benchmark::Task;
use softvt_robot::gripper::MAX_WIDTH;
use softvt_scene::{Asset, Scene};

/// Doubts about a scene of a task, one line each: units of materials, and a target that the gripper cannot grasp.
pub fn scene_doubts(task: &Task, scene: &Scene) -> BTreeSet<String> {
    let doubts = |asset: &Asset| {
        let name = asset.name.clone();
        asset.unit_doubts().into_iter().map(move |doubt| format!("asset {name}: {doubt}"))
    };
    let mut all: BTreeSet<String> = scene.objects.iter().flat_map(|object| doubts(&object.asset)).collect();
    let target = scene.objects.iter().find(|object| object.name == task.goal.object);
    all.extend(target.and_then(|target| width_doubt(&target.asset)));
    all
}

/// The width where the stock experts grasp an object, if it exceeds the opening of the gripper.
fn width_doubt(asset: &Asset) -> Option<String> {
    let size = asset.shape.bounds().size();
    let width = asset.hints.get(GRASP_WIDTH).copied().unwrap_or(size.x.min(size.y));
    (width >= MAX_WIDTH).then(|| {
        format!(
            "asset {}: it is {:.0} mm wide, and the gripper opens {:.0} mm; make it smaller, or give the width where it \
             can be grasped in hints.{GRASP_WIDTH}",
            asset.name,
            1e3 * width,
            1e3 * MAX_WIDTH
        )
    })
}

/// Hint for experts: width of the object where the fingers grasp it, m.
const GRASP_WIDTH: &str = "grasp_width_m";
