//! Scenes that are valid and most likely not what their author means.

use std::collections::BTreeSet;

use super::{
    asset_cache::{AssetCache, ThicknessProbe},
    joint_warnings::joint_warnings,
};
use softvt_benchmark::{CONTROL_DT, Task, goal_conflict::least_time};
use softvt_common::text::{format_number, is_misspelt, significant};
use softvt_geometry::pieces::SeparatePieces;
use softvt_robot::{gripper::MAX_WIDTH, panda::tool_in_hand};
use softvt_scene::{
    Asset, Body, CARRY_PACE_HINT, Camera, CameraMount, EXPERT_HINTS, GRASP_HEIGHT_HINT, GRASP_WIDTH_HINT,
    Lighting, Object, Scene, SoftMaterial,
};

/// Warnings about a scene of a task, one line each: materials, soft bodies of few voxels, bodies of several pieces or
/// off their axis, joints of unlikely numbers, hints with misspelt names, a target that the gripper cannot grasp,
/// objects outside of the workspace, cameras that do not show what the goal names or the fingers, a scene without
/// light, and a budget below what the goal takes.
pub fn scene_warnings(task: &Task, scene: &Scene, cache: &AssetCache) -> BTreeSet<String> {
    let warnings = |asset: &Asset| {
        let name = asset.name.clone();
        asset
            .warnings()
            .into_iter()
            .chain(voxel_warning(asset, cache))
            .chain(pieces_warning(asset, cache))
            .chain(origin_warning(asset, cache))
            .chain(joint_warnings(asset, cache))
            .chain(hint_warnings(asset))
            .chain(hint_value_warning(asset, cache))
            .map(move |warning| format!("asset {name}: {warning}"))
    };
    let mut all: BTreeSet<String> = scene.objects.iter().flat_map(|object| warnings(&object.asset)).collect();
    all.extend(scene.objects.iter().filter_map(|Object { nominal, asset, .. }| {
        // A layout may correct the friction of an asset. `softvt_runner` warns of other changes of it.
        let warning = nominal.friction_warning().filter(|_| asset.friction_warning().is_some())?;
        Some(format!("asset {}: {warning}", nominal.name))
    }));
    let (targets, goals) = (task.targets(), task.goal.predicates());
    let is_target = |object: &&Object| targets.contains(&object.name.as_str());
    let is_place = |object: &&Object| goals.iter().any(|goal| goal.target() == Some(&object.name));
    all.extend(scene.objects.iter().filter(is_target).filter_map(|target| width_warning(&target.asset)));
    // An object of a stack is both.
    let named: Vec<&Object> =
        scene.objects.iter().filter(|object| is_target(object) || is_place(object)).collect();
    all.extend(named.iter().filter_map(|object| workspace_warning(scene, object, cache)));
    all.extend(scene.cameras.iter().filter_map(|camera| view_warning(camera, &named, cache)));
    all.extend(scene.cameras.iter().filter_map(reach_warning));
    all.extend(light_warning(&scene.lighting));
    all.extend(budget_warning(task));
    all
}

/// Budget below which no manipulation is possible, control steps: the hand closes in about as many.
const MIN_BUDGET_STEPS: u32 = 10;

/// A warning about a task whose budget ends before its goal can have held, or before an arm can have done anything.
fn budget_warning(task: &Task) -> Option<String> {
    let (least_s, budget_s) = (least_time(&task.goal), f64::from(task.budget_steps) * CONTROL_DT);
    if least_s <= budget_s && task.budget_steps < MIN_BUDGET_STEPS {
        return Some(format!(
            "task {}: budget_steps is {}, {} s; no episode can reach its goal in so few control steps (20 per second)",
            task.id,
            task.budget_steps,
            significant(budget_s, 3)
        ));
    }
    (least_s > budget_s).then(|| {
        format!(
            "task {}: the goal must hold for {} s, and the budget is {} s: no episode can reach it",
            task.id,
            format_number(least_s),
            format_number(budget_s)
        )
    })
}

/// Voxels across a soft body below which its forces can be wrong by more than half.
const MIN_VOXELS: f64 = 2.0;
/// Depths at which a body is probed, per [`MIN_VOXELS`] voxels.
const PROBES: usize = 10;

/// The thickness of a soft body of which more than half of the surface has less than [`MIN_VOXELS`] voxels behind it.
fn voxel_warning(asset: &Asset, cache: &AssetCache) -> Option<String> {
    let Body::Soft(material) = &asset.body else { return None };
    let edge = cache.bounds(&asset.shape).size().max() / material.resolution.max(1) as f64;
    let probe = ThicknessProbe { step: MIN_VOXELS * edge / PROBES as f64, steps: PROBES, share: 0.5 };
    let thickness = cache.thickness(&asset.shape, probe)?;
    let needed = (material.resolution as f64 * MIN_VOXELS * edge / thickness).ceil();
    let fix = if needed <= SoftMaterial::MAX_RESOLUTION as f64 {
        format!("resolution = {needed} gives it two")
    } else {
        "make it thicker".to_owned()
    };
    Some(format!(
        "most of it is less than two voxels thick ({:.1} mm, a voxel is {:.1} mm), so that its stiffness can be wrong by more than \
         half; {fix}",
        1e3 * thickness,
        1e3 * edge
    ))
}

/// A warning about an object that begins outside of the workspace, or a place there.
fn workspace_warning(scene: &Scene, object: &Object, cache: &AssetCache) -> Option<String> {
    let centre = object.pose_w.transform_point(&cache.bounds(&object.asset.shape).centre().into());
    (!scene.workspace.contains(&centre.coords)).then(|| {
        format!(
            "object {}: it is at ({}, {}) m, outside of the workspace, where an object counts as dropped; move it, or set \
             scene.workspace_min and scene.workspace_max",
            object.name,
            format_number(centre.x),
            format_number(centre.y)
        )
    })
}

/// A warning about a camera of the world that shows none of the objects that the goal names.
fn view_warning(camera: &Camera, objects: &[&Object], cache: &AssetCache) -> Option<String> {
    let shows = |object: &&Object| {
        let bounds = cache.bounds(&object.asset.shape);
        let centre_w = object.pose_w.transform_point(&bounds.centre().into());
        camera.can_show(&camera.pose.inverse_transform_point(&centre_w).coords, 0.5 * bounds.size().norm())
    };
    (camera.mount == CameraMount::World && !objects.is_empty() && !objects.iter().any(shows)).then(|| {
        let names: Vec<&str> = objects.iter().map(|object| object.name.as_str()).collect();
        format!(
            "camera {}: {} not in its view at the start; change where it is, its look_at, or its far, {} m",
            camera.name,
            match &names[..] {
                [name] => format!("{name} is"),
                names => format!("{} are", names.join(", ")),
            },
            format_number(camera.far_m)
        )
    })
}

/// A warning about a camera on the hand whose images end before the fingers.
fn reach_warning(camera: &Camera) -> Option<String> {
    let distance = (tool_in_hand().translation.vector - camera.pose.translation.vector).norm();
    (camera.mount == CameraMount::Hand && camera.far_m < distance).then(|| {
        format!(
            "camera {}: its far is {} m, and the tool centre point is {} m away, so that it shows neither the fingers nor \
             what they hold; make far larger",
            camera.name,
            format_number(camera.far_m),
            significant(distance, 3)
        )
    })
}

/// Radiance of a white surface below which images are black: 8-bit images begin at about 3e-4.
const MIN_RADIANCE: f64 = 1e-3;

/// A warning about a scene whose images are black.
fn light_warning(light: &Lighting) -> Option<String> {
    let Lighting { key, sky, exposure, .. } = light;
    let largest = |colours: &[[f64; 3]]| colours.iter().flatten().fold(0.0, |max: f64, x| max.max(*x));
    let of_sky = sky.strength * largest(&[sky.zenith, sky.horizon, sky.ground]);
    (exposure * (key.strength * largest(&[key.colour]) + of_sky) < MIN_RADIANCE).then(|| {
        "scene.light: it is so weak that the images of all cameras are black; raise strength, sky_strength or exposure"
            .to_owned()
    })
}

/// Distance of the lowest point of an asset from z = 0, and share of its size by which its centre is off the z axis,
/// that are likely not meant.
const MAX_LIFT_M: f64 = 1e-3;
const MAX_OFFSET_SHARE: f64 = 0.3;

/// A warning about an asset whose origin is not below its centre.
fn origin_warning(asset: &Asset, cache: &AssetCache) -> Option<String> {
    if !matches!(asset.body, Body::Rigid { .. } | Body::Soft(_)) {
        return None;
    }
    let bounds = cache.bounds(&asset.shape);
    let (centre, size) = (bounds.centre(), bounds.size());
    let is_off = (0..2).any(|axis| centre[axis].abs() > MAX_OFFSET_SHARE * size[axis]);
    (is_off || bounds.min.z.abs() > MAX_LIFT_M).then(|| {
        format!(
            "its centre is {:.0} mm off the z axis, and its lowest point at z = {:.0} mm; end its shape with :grounded()",
            1e3 * centre.xy().norm(),
            // Not −0.
            (1e3 * bounds.min.z).round() + 0.0
        )
    })
}

/// A warning about a body of several pieces.
fn pieces_warning(asset: &Asset, cache: &AssetCache) -> Option<String> {
    let joined = match asset.body {
        Body::Rigid { .. } => "which move as one rigid body",
        Body::Soft(_) => "which its coarser voxel mesh joins into one soft body",
        _ => return None,
    };
    cache.pieces(&asset.shape).map(|SeparatePieces { count, gap }| {
        format!(
            "its shape has {count} separate pieces, about {:.0} mm apart, {joined}; join them, or make each an asset of its own",
            1e3 * gap
        )
    })
}

/// The width where the stock experts grasp an object, if it exceeds the opening of the gripper.
fn width_warning(asset: &Asset) -> Option<String> {
    let width = asset.grasp_width();
    if width >= MAX_WIDTH && asset.hints.contains_key(GRASP_WIDTH_HINT) {
        return Some(format!(
            "asset {}: hints.{GRASP_WIDTH_HINT} is {:.0} mm, and the gripper opens {:.0} mm; give the width where it can be \
             grasped",
            asset.name,
            1e3 * width,
            1e3 * MAX_WIDTH
        ));
    }
    (width >= MAX_WIDTH).then(|| {
        format!(
            "asset {}: it is {:.0} mm wide, and the gripper opens {:.0} mm; make it smaller, or give the width where it \
             can be grasped in hints.{GRASP_WIDTH_HINT}",
            asset.name,
            1e3 * width,
            1e3 * MAX_WIDTH
        )
    })
}

/// A warning about a hint that does not fit the object.
fn hint_value_warning(asset: &Asset, cache: &AssetCache) -> Option<String> {
    if let Some(pace) = asset.hints.get(CARRY_PACE_HINT).filter(|pace| !(**pace > 0.0 && **pace <= 1.0)) {
        return Some(format!(
            "hints.{CARRY_PACE_HINT} is {}; expected a number above 0, at most 1",
            format_number(*pace)
        ));
    }
    let size = cache.bounds(&asset.shape).size();
    let mm = |metres: f64| format_number((1e4 * metres).round() / 10.0);
    let sideways = 0.5 * size.xy().max();
    let lengths = [
        (GRASP_HEIGHT_HINT, 0.0..=size.z),
        (GRASP_WIDTH_HINT, 0.0..=size.xy().norm()),
        ("grasp_offset_m", -sideways..=sideways),
        ("surface_m", 0.0..=size.z),
        ("wall_m", 0.0..=sideways),
    ];
    let misfit = lengths.iter().find_map(|(name, range)| {
        let value = asset.hints.get(*name).filter(|value| !range.contains(value))?;
        Some((name, value))
    });
    if let Some((name, value)) = misfit {
        return Some(format!(
            "hints.{name} is {} mm, and the object is {} × {} × {} mm; lengths are in metres",
            mm(*value),
            mm(size.x),
            mm(size.y),
            mm(size.z)
        ));
    }
    let (hint, width) = (asset.hints.get(GRASP_WIDTH_HINT)?, width_at_grasp(asset, cache)?);
    (*hint < MIN_WIDTH_SHARE * width).then(|| {
        format!(
            "hints.{GRASP_WIDTH_HINT} is {} mm, and it is {} mm wide at that height; lengths are in metres",
            mm(*hint),
            mm(width)
        )
    })
}

/// Share of the width of an object below which a hint cannot mean it.
const MIN_WIDTH_SHARE: f64 = 0.5;
/// Points on the line across an object that measures its width.
const WIDTH_POINTS: usize = 100;

/// Width of a free object through its centre at the height of its grasp, along x or y, whichever is smaller, m. `None`
/// if it is grasped elsewhere, or is hollow there.
fn width_at_grasp(asset: &Asset, cache: &AssetCache) -> Option<f64> {
    let is_free = matches!(asset.body, Body::Rigid { .. } | Body::Soft(_));
    if !is_free || ["grasp_rim_m", "grasp_offset_m"].iter().any(|hint| asset.hints.contains_key(*hint)) {
        return None;
    }
    let bounds = cache.bounds(&asset.shape);
    let (mut centre, size) = (bounds.centre(), bounds.size());
    centre.z = bounds.min.z + asset.hints.get(GRASP_HEIGHT_HINT).copied().unwrap_or(0.5 * size.z);
    let width_along = |axis: usize| {
        let step = size[axis] / WIDTH_POINTS as f64;
        let is_inside = |point: &usize| {
            let mut at = centre;
            at[axis] = bounds.min[axis] + (*point as f64 + 0.5) * step;
            asset.shape.distance(&at) < 0.0
        };
        (0..WIDTH_POINTS).filter(is_inside).count() as f64 * step
    };
    let width = width_along(0).min(width_along(1));
    (width > 0.0).then_some(width)
}

/// Warnings about hints whose names are close to one that the standard experts read, of the asset and of its parts.
fn hint_warnings(asset: &Asset) -> Vec<String> {
    let of_parts = asset.parts().iter().flat_map(|part| part.asset.hints.keys());
    let unknown = asset.hints.keys().chain(of_parts).filter(|name| !EXPERT_HINTS.contains(&name.as_str()));
    let warning = |name: &String| {
        // One that the asset has as well is another hint.
        let is_meant = |known: &&str| is_misspelt(name, known) && !asset.hints.contains_key(*known);
        let close = EXPERT_HINTS.into_iter().find(is_meant)?;
        Some(format!("the standard experts do not read hints.{name}; did you mean {close}?"))
    };
    unknown.filter_map(warning).collect()
}
