//! Articulated objects in the world: a fixed base and a joint tree, one handle for the whole and one for each part.

use super::{
    asset_cache::AssetCache,
    build::BuildError,
    simulation::{ArticulatedPart, ObjectInstance},
};
use crate::{
    geometry::{Pose, Vec3, shape::Shape},
    physics::{
        ArticulationId, LinkId, World,
        joints::{JointKind, JointTree, Link},
    },
    scene::{JointMotion, Object, Part},
    text::format_number,
};

/// Walls of moving parts are at least this thick, m: a thinner one could be crossed between two steps.
const LEAST_WALL: f64 = 4e-3;
/// Step of the search for the far side of a wall, m; what is this much thinner still passes.
const WALL_STEP: f64 = 2e-4;
/// Share of a part's surface that may have a thin wall under it: rims and edges do.
const THIN_SHARE: f64 = 0.1;
/// Rays along each edge of a side from which walls are looked for.
const RAYS: usize = 12;

/// Puts the parts of an articulated object into `world`; their handles come after that of the whole, which is `base`.
pub(super) fn add(
    world: &mut World,
    object: &Object,
    parts: &[Part],
    base: usize,
    cache: &AssetCache,
) -> Result<(ArticulationId, Vec<ObjectInstance>), BuildError> {
    for part in parts {
        check_walls(object, part, cache)?;
    }
    let links = parts.iter().map(|part| link(part, parts, cache)).collect();
    let tree = JointTree { links, base_w: object.pose_w };
    tree.validate().map_err(|source| BuildError::Joints { object: object.name.clone(), source })?;
    let drives = vec![None; parts.len()];
    let articulation = world.add_articulation(&object.name, tree, &object.joints, drives, true);
    let handles = parts.iter().enumerate().map(|(index, part)| {
        let name = format!("{}.{}", object.name, part.name);
        let link = LinkId { articulation, index };
        let pose_in_link = Pose::from(-part.joint.origin_o);
        let (shape, friction) = (&part.asset.shape, part.asset.friction);
        let collider = cache.collider(world, &name, link.into(), pose_in_link, shape, friction);
        ObjectInstance {
            name,
            asset: part.asset.clone(),
            body: link.into(),
            start_w: world.link_pose(link) * pose_in_link,
            colliders: vec![world.add_collider(collider)],
            bounds: cache.bounds(&part.asset.shape),
            part: Some(ArticulatedPart { object: base, name: part.name.clone(), joint: part.joint.clone() }),
        }
    });
    Ok((articulation, handles.collect()))
}

/// A part as a link whose frame is the object's, moved to the origin of its joint.
fn link(part: &Part, parts: &[Part], cache: &AssetCache) -> Link {
    let m = cache.mass(&part.asset.shape, part.density);
    let joint = &part.joint;
    let axis = nalgebra::Unit::new_normalize(joint.axis_o);
    let carrier = part.parent.map_or(Vec3::zeros(), |parent| parts[parent].joint.origin_o);
    Link {
        name: part.name.clone(),
        parent: part.parent,
        placement: Pose::from(joint.origin_o - carrier),
        kind: match joint.motion {
            JointMotion::Slide => JointKind::Prismatic(axis),
            JointMotion::Turn => JointKind::Revolute(axis),
        },
        mass: m.mass,
        com: m.com - joint.origin_o,
        inertia: (m.inertia + m.inertia.transpose()) * 0.5,
        lower: joint.lower,
        upper: joint.upper,
        velocity_limit: f64::INFINITY,
        effort_limit: f64::INFINITY,
        friction: joint.friction,
        damping: joint.damping,
    }
}

fn check_walls(object: &Object, part: &Part, cache: &AssetCache) -> Result<(), BuildError> {
    match cache.wall(&part.asset.shape) {
        None => Ok(()),
        Some(wall) => Err(BuildError::Material {
            asset: object.asset.name.clone(),
            what: format!(
                "part {}: its walls are about {} mm thick, expected at least {} mm: what meets a thinner one may pass \
                 through it",
                part.name,
                format_number((1e4 * wall).round() / 10.0),
                format_number(1e3 * LEAST_WALL)
            ),
        }),
    }
}

/// Typical thickness of those walls of a shape that are thinner than a moving part's may be, m; `None` if too little of its
/// surface has such.
pub(super) fn thin_wall(shape: &Shape) -> Option<f64> {
    let hits = seen_from_outside(shape);
    let steps = (LEAST_WALL / WALL_STEP).round() as usize;
    let under = |p: &Vec3| {
        let normal = shape.distance_and_normal(p).1;
        let mut depths = (1..steps).map(|step| WALL_STEP * step as f64);
        depths.find(|depth| shape.distance(&(p - normal * *depth)) > 0.0)
    };
    let mut thin: Vec<f64> = hits.iter().filter_map(under).collect();
    if thin.len() as f64 <= THIN_SHARE * hits.len() as f64 {
        return None;
    }
    thin.sort_by(f64::total_cmp);
    Some(thin[thin.len() / 2])
}

/// Points of the surface that parallel rays along the six directions of the axes meet first. Rays find walls however
/// thin, which a grid would miss.
fn seen_from_outside(shape: &Shape) -> Vec<Vec3> {
    let bounds = shape.bounds();
    let size = bounds.size();
    let mut hits = Vec::new();
    for (axis, far) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut ahead = Vec3::zeros();
        ahead[axis] = if far { -1.0 } else { 1.0 };
        for cell in 0..RAYS * RAYS {
            let share = |index: usize| (index as f64 + 0.5) / RAYS as f64;
            let mut start = if far { bounds.max } else { bounds.min };
            start[u] = bounds.min[u] + size[u] * share(cell % RAYS);
            start[v] = bounds.min[v] + size[v] * share(cell / RAYS);
            start -= ahead * LEAST_WALL;
            let hit = shape.ray(&start, &ahead, size[axis] + 2.0 * LEAST_WALL);
            hits.extend(hit.map(|length| start + ahead * length));
        }
    }
    hits
}
