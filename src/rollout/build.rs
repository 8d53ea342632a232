//! Builds the bodies and colliders of a scene.

use std::sync::Arc;

use super::{articulated, asset_cache::AssetCache, build_error::BuildError, object::ObjectInstance};
use crate::{
    geometry::Pose,
    physics::{BodyId, World, contact::ContactSurface, rigid::RigidState},
    scene::{Body, Object, Scene},
    text::format_number,
};

/// Minimum thickness of rigid walls, m. Other bodies can pass through thinner ones between two steps.
const MIN_WALL: f64 = 2e-3;
/// Minimum length of the longest side of an object, m. Less is nearly always a wrong scale.
const MIN_SIZE: f64 = 1e-3;

fn check_scale(object: &Object, cache: &AssetCache) -> Result<(), BuildError> {
    let longest = cache.bounds(&object.asset.shape).size().max();
    // Meshing reports an empty shape.
    if longest >= MIN_SIZE || longest == 0.0 {
        return Ok(());
    }
    let what = format!(
        "it is {longest:.1e} m long, expected at least {} m; sizes are in metres (a mesh has a scale)",
        format_number(MIN_SIZE)
    );
    Err(BuildError::Material { asset: object.asset.name.clone(), what })
}

fn check_thickness(object: &Object, cache: &AssetCache) -> Result<(), BuildError> {
    match cache.wall(&object.asset.shape).filter(|wall| *wall < MIN_WALL) {
        None => Ok(()),
        Some(wall) => Err(BuildError::Material {
            asset: object.asset.name.clone(),
            what: format!(
                "it is about {} mm thick, or its walls are, expected at least {} mm: other bodies may pass \
                 through thinner ones",
                format_number((1e4 * wall).round() / 10.0),
                format_number(1e3 * MIN_WALL)
            ),
        }),
    }
}

/// Tolerated initial overlap, m. Contact forces resolve it while the objects settle.
const MAX_OVERLAP: f64 = 1e-3;

/// Adds all objects of a scene to the world, in the order of the scene, each followed by its parts.
pub(super) fn add_all(
    world: &mut World,
    scene: &Scene,
    cache: &AssetCache,
) -> Result<Vec<ObjectInstance>, BuildError> {
    let mut instances: Vec<ObjectInstance> = Vec::new();
    for object in &scene.objects {
        if instances.iter().any(|known| known.name == object.name) {
            return Err(BuildError::TwoNames(object.name.clone()).of(object));
        }
        add(world, object, cache, &mut instances).map_err(|error| error.of(object))?;
    }
    Ok(instances)
}

/// Checks that no objects overlap each other or the robot, which must be in `world` already.
pub(super) fn check_overlap(world: &mut World, scene: &Scene) -> Result<(), BuildError> {
    let found = world.penetrations(MAX_OVERLAP);
    let Some(deepest) = found.iter().max_by(|a, b| a.depth.total_cmp(&b.depth)) else { return Ok(()) };
    // The name of a part is that of its object, a dot and its own name.
    let index = |name: &str| {
        let whole = name.split('.').next().unwrap_or(name);
        scene.objects.iter().position(|object| object.name == whole)
    };
    let [mut first, mut second] = [0, 1].map(|i| (index(&deepest.names[i]), deepest.names[i].clone()));
    if first.0 < second.0 {
        // The error names the object that was placed last first.
        std::mem::swap(&mut first, &mut second);
    }
    if let (Some(index), None) = (first.0, second.0) {
        // Only the colliders of the robot belong to no object.
        let (object, part) = (first.1, second.1);
        return Err(BuildError::InRobot { object, part, depth: deepest.depth }.of(&scene.objects[index]));
    }
    let place = |index: Option<usize>| index.map_or(String::new(), |i| scene.objects[i].placed_at.clone());
    let error = BuildError::Overlap {
        first: first.1,
        second: second.1,
        second_at: place(second.0),
        depth: deepest.depth,
    };
    Err(match first.0 {
        Some(index) => error.of(&scene.objects[index]),
        None => error,
    })
}

/// Radius of the robot's first two links, m, which have no colliders, and their extent along the axis of the base
/// (from the collision meshes of the public `franka_description`, rounded inwards).
const BASE_RADIUS: f64 = 0.05;
const BASE_LOW: f64 = 0.03;
const BASE_HIGH: f64 = 0.33;

/// Checks that no movable object overlaps the base of the robot.
pub(super) fn check_base(scene: &Scene) -> Result<(), BuildError> {
    let movable = |object: &&Object| matches!(object.asset.body, Body::Soft(_) | Body::Rigid { .. });
    for object in scene.objects.iter().filter(movable) {
        let column_o = object.pose_w.inverse() * scene.base_w;
        let steps = ((BASE_HIGH - BASE_LOW) / BASE_RADIUS).ceil() as usize;
        let inside = (0..=steps).any(|step| {
            let z = BASE_LOW + (BASE_HIGH - BASE_LOW) * step as f64 / steps as f64;
            object.asset.shape.distance(&(column_o * nalgebra::Point3::new(0.0, 0.0, z)).coords) < BASE_RADIUS
        });
        if inside {
            return Err(BuildError::InBase(object.name.clone()).of(object));
        }
    }
    Ok(())
}

/// Adds an object with its parts to the world and to `instances`.
fn add(
    world: &mut World,
    object: &Object,
    cache: &AssetCache,
    instances: &mut Vec<ObjectInstance>,
) -> Result<(), BuildError> {
    let asset = &object.asset;
    check_scale(object, cache)?;
    if matches!(asset.body, Body::Rigid { .. }) {
        check_thickness(object, cache)?;
    }
    let collider = |world: &World, parent: BodyId, pose_in_parent| {
        cache.collider(world, &object.name, parent, pose_in_parent, &asset.shape, asset.friction)
    };
    let mut parts = Vec::new();
    let (body, colliders) = match &asset.body {
        Body::Soft(material) => {
            let model = cache.model(asset, material)?;
            let surface: Arc<dyn ContactSurface> = Arc::new(asset.shape.clone());
            let id = world.add_soft(&object.name, model, Some(surface), &object.pose_w, asset.friction);
            (id.into(), Vec::new())
        }
        Body::Rigid { density } => {
            let m = cache.mass(&asset.shape, *density);
            let body = RigidState::new(&object.pose_w, m.com, m.mass, m.inertia)
                .map_err(|source| BuildError::Rigid { asset: asset.name.clone(), source })?;
            let body = BodyId::Rigid(world.add_rigid(&object.name, body));
            let collider = collider(world, body, Pose::identity());
            (body, vec![world.add_collider(collider)])
        }
        Body::Articulated(asset_parts) => {
            let (articulation, added) = articulated::add(world, object, asset_parts, instances.len(), cache)?;
            parts = added;
            let base = collider(world, BodyId::World, object.pose_w).as_base_of(articulation);
            (BodyId::World, vec![world.add_collider(base)])
        }
        Body::Static => {
            let collider = collider(world, BodyId::World, object.pose_w);
            (BodyId::World, vec![world.add_collider(collider)])
        }
        Body::Scenery => (BodyId::World, Vec::new()),
    };
    instances.push(ObjectInstance {
        name: object.name.clone(),
        asset: asset.clone(),
        body,
        start_w: object.pose_w,
        colliders,
        bounds: cache.bounds(&asset.shape),
        part: None,
    });
    instances.extend(parts);
    Ok(())
}
