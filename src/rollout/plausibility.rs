//! Scenes that are valid and most likely not what their author means, as far as it takes geometry to tell. Numbers that
//! are unlikely by themselves have a [usual range](softvt_common::range::Range::usually) where they are declared.

use std::collections::BTreeSet;

use super::{
    asset_cache::{AssetCache, ThicknessProbe},
    build_error::tenths_of_mm as mm,
};
use softvt_benchmark::{CONTROL_DT, Task, goal_conflict::least_time, variation::VariationRanges};
use softvt_common::text::{format_number, is_misspelt, significant};
use softvt_geometry::{Aabb, pieces::SeparatePieces};
use softvt_physics::STANDARD_GRAVITY;
use softvt_robot::gripper::MAX_WIDTH;
use softvt_scene::{
    Asset, Body, Camera, CameraMount, EXPERT_HINTS, GRASP_HEIGHT_HINT, GRASP_WIDTH_HINT, Object, Scene,
    SceneVariation, SoftMaterial,
};

/// Warnings about a scene of a task, one line each: its assets, targets that the gripper cannot grasp,
/// objects outside of the workspace, cameras that show nothing of the goal, a goal that takes longer than the budget,
/// and goals that judge no deformation. `judges_soft` is false in suites of rigid objects.
pub fn scene_warnings(task: &Task, scene: &Scene, judges_soft: bool, cache: &AssetCache) -> BTreeSet<String> {
    let of_assets = scene.objects.iter().flat_map(|object| {
        let name = object.asset.name.clone();
        asset_warnings(&object.asset, cache)
            .into_iter()
            .map(move |warning| format!("asset {name}: {warning}"))
    });
    let (targets, goals) = (task.targets(), task.goal.predicates());
    let is_target = |object: &&Object| targets.contains(&object.name.as_str());
    let is_place = |object: &&Object| goals.iter().any(|goal| goal.target() == Some(&object.name));
    let moved: Vec<&Object> = scene.objects.iter().filter(is_target).collect();
    let wide = moved.iter().filter_map(|object| {
        let width = object.asset.grasp_width();
        (width >= MAX_WIDTH).then(|| {
            format!(
                "asset {}: it is {} mm wide, and the gripper opens {} mm; make it smaller, or give the width where it can \
                 be grasped in hints.{GRASP_WIDTH_HINT}",
                object.asset.name,
                mm(width),
                mm(MAX_WIDTH)
            )
        })
    });
    // An object of a stack is both.
    let named: Vec<&Object> =
        scene.objects.iter().filter(|object| is_target(object) || is_place(object)).collect();
    let outside = named.iter().filter_map(|object| outside_of_workspace(scene, object, cache));
    let unseen = scene.cameras.iter().filter_map(|camera| shows_nothing(camera, &named, cache));
    let (least_s, budget_s) = (least_time(&task.goal), f64::from(task.budget_steps) * CONTROL_DT);
    let late = (least_s > budget_s).then(|| {
        let [least_s, budget_s] = [least_s, budget_s].map(format_number);
        format!("task {}: the goal must hold for {least_s} s, and the budget is {budget_s} s: no episode can reach it", task.id)
    });
    let has_soft = moved.iter().any(|object| matches!(object.asset.body, Body::Soft(_)));
    let unjudged = (judges_soft && !has_soft).then(|| {
        let targets = targets.join(", ");
        format!("task {}: its goal moves no soft object, only {targets}: no deformation is judged", task.id)
    });
    of_assets.chain(wide).chain(outside).chain(unseen).chain(late).chain(unjudged).collect()
}

/// Warnings about an asset, one phrase each: soft bodies of few voxels or that sag, bodies of several
/// pieces or off their axis, parts away from their object, hints that do not fit, visuals that do not show.
pub fn asset_warnings(asset: &Asset, cache: &AssetCache) -> Vec<String> {
    let found = [few_voxels(asset, cache), sag(asset, cache), pieces(asset, cache), off_axis(asset, cache)];
    let mut warnings: Vec<String> = found.into_iter().flatten().collect();
    warnings.extend(away_parts(asset, cache));
    warnings.extend(misfit_hint(asset, cache));
    warnings.extend(misspelt_hints(asset));
    warnings.extend(unpainted_visuals(asset));
    warnings
}

/// Voxels across a soft body below which its forces can be wrong by more than half.
const MIN_VOXELS: f64 = 2.0;
/// Depths at which a body is probed, per [`MIN_VOXELS`] voxels.
const PROBES: usize = 10;

/// Finds a soft body of which more than half of the surface has less than [`MIN_VOXELS`] voxels behind it.
fn few_voxels(asset: &Asset, cache: &AssetCache) -> Option<String> {
    let Body::Soft(material) = &asset.body else { return None };
    let edge = cache.bounds(&asset.shape).size().max() / material.resolution.max(1) as f64;
    let probe = ThicknessProbe { step: MIN_VOXELS * edge / PROBES as f64, steps: PROBES, share: 0.5 };
    let thickness = cache.shape(&asset.shape).thickness(probe)?;
    let needed = (material.resolution as f64 * MIN_VOXELS * edge / thickness).ceil();
    let fix = match needed <= SoftMaterial::MAX_RESOLUTION as f64 {
        true => format!("resolution = {needed} gives it two"),
        false => "make it thicker".to_owned(),
    };
    Some(format!(
        "most of it is less than two voxels thick ({} mm, a voxel is {} mm), so that its stiffness can be wrong by more \
         than half; {fix}",
        mm(thickness),
        mm(edge)
    ))
}

/// Compression by its own weight from which on a body hardly stands.
const MAX_SAG: f64 = 0.15;

/// Finds a soft body that is compressed by its own weight: ρ g h / 2 E for an upright block of height h.
fn sag(asset: &Asset, cache: &AssetCache) -> Option<String> {
    let material = asset.elastic()?;
    let height = cache.bounds(&asset.shape).size().z;
    let weight_pa = material.density() * STANDARD_GRAVITY.norm() * height;
    let sag = 0.5 * weight_pa / material.youngs_pa();
    (sag >= MAX_SAG).then(|| {
        let (youngs_pa, sag) = (format_number(material.youngs_pa()), (100.0 * sag.min(1.0)).round());
        format!(
            "its own weight presses it down by {sag} %: it is {} mm high, youngs_pa is {youngs_pa} Pa",
            mm(height)
        )
    })
}

/// Finds a body of several pieces.
fn pieces(asset: &Asset, cache: &AssetCache) -> Option<String> {
    let joined = match asset.body {
        Body::Rigid { .. } => "which move as one rigid body",
        Body::Soft(_) => "which its coarser voxel mesh joins into one soft body",
        _ => return None,
    };
    cache.shape(&asset.shape).pieces().map(|SeparatePieces { count, gap }| {
        let gap = mm(gap);
        format!("its shape has {count} separate pieces, about {gap} mm apart, {joined}; join them, or make each an asset")
    })
}

/// Distance of the lowest point of an asset from z = 0, and share of its size by which its centre is off the z axis,
/// that are likely not meant.
const MAX_LIFT_M: f64 = 1e-3;
const MAX_OFFSET_SHARE: f64 = 0.3;

/// Finds a body whose origin is not below its centre.
fn off_axis(asset: &Asset, cache: &AssetCache) -> Option<String> {
    if !matches!(asset.body, Body::Rigid { .. } | Body::Soft(_)) {
        return None;
    }
    let bounds = cache.bounds(&asset.shape);
    let (centre, size) = (bounds.centre(), bounds.size());
    let is_off = (0..2).any(|axis| centre[axis].abs() > MAX_OFFSET_SHARE * size[axis]);
    (is_off || bounds.min.z.abs() > MAX_LIFT_M).then(|| {
        let (off, lowest) = (mm(centre.xy().norm()), mm(bounds.min.z));
        format!("its centre is {off} mm off the z axis, and its lowest point at z = {lowest} mm; end its shape with :grounded()")
    })
}

/// Finds parts that are farther from the rest of their object than their own size, with all joints at 0.
fn away_parts(asset: &Asset, cache: &AssetCache) -> Vec<String> {
    let parts = asset.parts();
    let bounds: Vec<Aabb> = parts.iter().map(|part| cache.bounds(&part.asset.shape)).collect();
    let base = cache.bounds(&asset.shape);
    let warning = |index: usize| {
        let others = bounds.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, other)| other);
        let gaps = others.chain([&base]).map(|other| bounds[index].distance(other));
        let (gap, size) = (gaps.fold(f64::INFINITY, f64::min), bounds[index].size().max());
        (gap > size).then(|| {
            format!(
                "part {}: it is {} mm away from the rest of the object, and {} mm long; its shape is in the frame of the \
                 whole object",
                parts[index].name,
                mm(gap),
                mm(size)
            )
        })
    };
    (0..parts.len()).filter_map(warning).collect()
}

/// Finds a hint that is a length and does not fit the object.
fn misfit_hint(asset: &Asset, cache: &AssetCache) -> Option<String> {
    let size = cache.bounds(&asset.shape).size();
    let sideways = 0.5 * size.xy().max();
    let lengths = [
        (GRASP_HEIGHT_HINT, 0.0..=size.z),
        (GRASP_WIDTH_HINT, 0.0..=size.xy().norm()),
        ("grasp_offset_m", -sideways..=sideways),
        ("surface_m", 0.0..=size.z),
        ("wall_m", 0.0..=sideways),
    ];
    lengths.iter().find_map(|(name, range)| {
        let value = asset.hints.get(*name).filter(|value| !range.contains(value))?;
        let [value, x, y, z] = [*value, size.x, size.y, size.z].map(mm);
        Some(format!(
            "hints.{name} is {value} mm, and the object is {x} × {y} × {z} mm; lengths are in metres"
        ))
    })
}

/// Finds hints whose names are close to one that the standard experts read, of the asset and of its parts.
fn misspelt_hints(asset: &Asset) -> impl Iterator<Item = String> {
    let of_parts = asset.parts().iter().flat_map(|part| part.asset.hints.keys());
    let unknown = asset.hints.keys().chain(of_parts).filter(|name| !EXPERT_HINTS.contains(&name.as_str()));
    unknown.filter_map(|name| {
        // One that the asset has as well is another hint.
        let is_meant = |known: &&str| is_misspelt(name, known) && !asset.hints.contains_key(*known);
        let close = EXPERT_HINTS.into_iter().find(is_meant)?;
        Some(format!("the standard experts do not read hints.{name}; did you mean {close}?"))
    })
}

/// Finds visuals that no part of the shape is painted with.
fn unpainted_visuals(asset: &Asset) -> impl Iterator<Item = String> {
    let shapes = asset.parts().iter().map(|part| &part.asset.shape).chain([&asset.shape]);
    let painted = shapes.map(|shape| usize::from(shape.highest_material()) + 1).max().unwrap_or(1);
    let of_parts = asset.parts().iter().map(|part| part.asset.visuals.len());
    let visuals = of_parts.chain([asset.visuals.len()]).max().unwrap_or_default();
    (painted..visuals).map(|index| {
        format!(
            "visuals[{}]: no part of the shape is painted with material {index}; use shape:paint",
            index + 1
        )
    })
}

/// Finds an object, or a place of the goal, outside of the workspace.
fn outside_of_workspace(scene: &Scene, object: &Object, cache: &AssetCache) -> Option<String> {
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

/// Finds a camera of the world that shows none of the objects that the goal names.
fn shows_nothing(camera: &Camera, objects: &[&Object], cache: &AssetCache) -> Option<String> {
    let shows = |object: &&Object| {
        let bounds = cache.bounds(&object.asset.shape);
        let centre_w = object.pose_w.transform_point(&bounds.centre().into());
        camera.can_show(&camera.pose.inverse_transform_point(&centre_w).coords, 0.5 * bounds.size().norm())
    };
    (camera.mount == CameraMount::World && !objects.is_empty() && !objects.iter().any(shows)).then(|| {
        let names: Vec<&str> = objects.iter().map(|object| object.name.as_str()).collect();
        format!(
            "camera {}: nothing of the goal ({}) is in its view; change where it is, its look_at, or its far, {} m",
            camera.name,
            names.join(", "),
            format_number(camera.far_m)
        )
    })
}

/// Coefficients that differ by less are equal.
const ROUNDING: f64 = 1e-9;

/// Warnings about free objects whose static friction acts in no contact, since a pair of surfaces takes the larger
/// coefficient and all that holds or carries them has a larger one: `pads_mu` and those of fixed objects. Of a drawn
/// friction, the largest that can be drawn counts. Of one that is lower than in the `nominal` scene, the pads alone
/// count, since grips are no looser than without the change.
pub fn ineffective_friction(
    scene: &Scene,
    nominal: &Scene,
    variation: Option<(&VariationRanges, &SceneVariation)>,
    pads_mu: f64,
) -> Vec<String> {
    let is_fixed = |object: &&Object| matches!(object.asset.body, Body::Static | Body::Articulated(_));
    let fixed = scene.objects.iter().filter(is_fixed).map(|object| object.asset.friction.static_mu);
    let others_mu = fixed.fold(pads_mu, f64::min);
    let warning = |object: &Object| {
        let friction = object.asset.friction;
        let drawn = variation.and_then(|(ranges, drawn)| {
            Some(ranges.friction.max / drawn.objects.get(&object.name)?.friction_factor)
        });
        let mu = friction.static_mu * drawn.unwrap_or(1.0);
        let is_free = matches!(object.asset.body, Body::Soft(_) | Body::Rigid { .. });
        let was = nominal.objects.iter().find(|other| other.name == object.name);
        let was = was.map_or(mu, |was| was.asset.friction.static_mu);
        let is_lowered = friction.static_mu < was - ROUNDING && was <= pads_mu + ROUNDING;
        let (least, surfaces) = if is_lowered { (pads_mu, "pads") } else { (others_mu, "pads and tables") };
        (is_free && !friction.coated && mu < least - ROUNDING).then(|| {
            format!(
                "object {}: its static_mu is {}, and a pair of surfaces takes the larger coefficient, which is at least {} on \
                 {surfaces}; that of a coating (coated = true) counts in every pair",
                object.name,
                significant(mu, 3),
                significant(least, 3)
            )
        })
    };
    scene.objects.iter().filter_map(warning).collect()
}
