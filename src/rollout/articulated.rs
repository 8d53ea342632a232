//! Articulated objects in the world: a fixed base and a tree of joints, with an instance per part.

use super::{
    asset_cache::{AssetCache, MIN_PART_WALL},
    build_error::BuildError,
    object::{ArticulatedPart, ObjectInstance},
};
use crate::{
    geometry::{Pose, Vec3},
    physics::{
        ArticulationId, LinkId, World,
        joints::{JointKind, JointTree, Link},
    },
    scene::{JointMotion, Object, Part},
    text::format_number,
};

/// Adds the parts of an articulated object to the world. `base` is the index of the whole object.
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
    let instances = parts.iter().enumerate().map(|(index, part)| {
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
    Ok((articulation, instances.collect()))
}

/// Link of a part. Its frame is that of the object, translated to the origin of the joint.
fn link(part: &Part, parts: &[Part], cache: &AssetCache) -> Link {
    let m = cache.mass(&part.asset.shape, part.density);
    let joint = &part.joint;
    let axis = nalgebra::Unit::new_normalize(joint.axis_o);
    let parent_origin = part.parent.map_or(Vec3::zeros(), |parent| parts[parent].joint.origin_o);
    Link {
        name: part.name.clone(),
        parent: part.parent,
        placement: Pose::from(joint.origin_o - parent_origin),
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
                "part {}: its walls are about {} mm thick, expected at least {} mm: other bodies may pass \
                 through thinner ones",
                part.name,
                format_number((1e4 * wall).round() / 10.0),
                format_number(1e3 * MIN_PART_WALL)
            ),
        }),
    }
}
