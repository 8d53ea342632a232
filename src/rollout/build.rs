//! Builds the bodies and colliders of a scene.

use std::sync::Arc;

use super::{
    asset_cache::{AssetCache, MIN_PART_WALL},
    build_error::{SceneBuildError, tenths_of_mm},
    simulation::{ArticulatedPart, ObjectInstance},
    soft_model::MAX_NODES,
};
use softvt_common::text::format_number;
use softvt_geometry::{Pose, Vec3};
use softvt_physics::{
    ArticulationId, BodyId, LinkId, World,
    contact::{ContactSurface, Friction},
    joints::{JointKind, JointTree, Link},
    rigid::RigidState,
};
use softvt_scene::{Body, JointMotion, MovingPart, Object, Scene};

/// Minimum thickness of rigid walls, m. Other bodies can pass through thinner ones between two steps.
const MIN_WALL: f64 = 2e-3;
/// Minimum length of the longest side of an object, m. Less is nearly always a wrong scale.
const MIN_SIZE: f64 = 1e-3;

/// Describes an object with a wrong scale, with more friction when it slides than when it rests, as layouts change both
/// numbers separately, or with walls that other bodies may pass through.
fn problem(object: &Object, cache: &AssetCache) -> Option<String> {
    let (asset, longest) = (&object.asset, cache.bounds(&object.asset.shape).size().max());
    // Meshing reports an empty shape.
    if longest < MIN_SIZE && longest != 0.0 {
        let least = format_number(MIN_SIZE);
        return Some(format!(
            "it is {longest:.1e} m long, expected at least {least} m; sizes are in metres (a mesh has a scale)"
        ));
    }
    let Friction { static_mu, dynamic_mu, .. } = asset.friction;
    if dynamic_mu > static_mu {
        let [dynamic_mu, static_mu] = [dynamic_mu, static_mu].map(format_number);
        return Some(format!(
            "dynamic_mu is {dynamic_mu}, above static_mu, {static_mu}; set both, the larger one as static_mu"
        ));
    }
    if !matches!(asset.body, Body::Rigid { .. }) {
        return None;
    }
    let wall = cache.shape(&asset.shape).wall().filter(|wall| *wall < MIN_WALL)?;
    Some(too_thin(&format!("it is about {} mm thick, or its walls are", tenths_of_mm(wall)), MIN_WALL))
}

/// The problem of walls thinner than `min` (m); `description` states how thick they are.
fn too_thin(description: &str, min: f64) -> String {
    let min = format_number(1e3 * min);
    format!("{description}, expected at least {min} mm: other bodies may pass through thinner ones")
}

/// Tolerated initial overlap, m. Contact forces resolve it while the objects settle.
pub const MAX_OVERLAP: f64 = 1e-3;

/// Adds all objects of a scene to the world, in the order of the scene, each followed by its parts.
pub(super) fn add_all(
    world: &mut World,
    scene: &Scene,
    cache: &AssetCache,
) -> Result<Vec<ObjectInstance>, SceneBuildError> {
    let mut instances: Vec<ObjectInstance> = Vec::new();
    for object in &scene.objects {
        if instances.iter().any(|known| known.name == object.name) {
            return Err(SceneBuildError::DuplicateName(object.name.clone()).of(object));
        }
        let factor = world.params.mesh_refinement;
        let refined = (factor != 1.0).then(|| object.refined(factor));
        let object = refined.as_ref().unwrap_or(object);
        add(world, object, cache, &mut instances).map_err(|error| error.of(object))?;
    }
    Ok(instances)
}

/// Checks that no objects overlap each other or the robot, which must be in `world` already.
pub(super) fn check_overlap(world: &mut World, scene: &Scene) -> Result<(), SceneBuildError> {
    let found = world.penetrations(MAX_OVERLAP);
    let Some(deepest) = found.iter().max_by(|a, b| a.depth.total_cmp(&b.depth)) else { return Ok(()) };
    // The name of a part is that of its object, a dot and its own name.
    let index = |name: &str| {
        let whole = name.split('.').next().unwrap_or(name);
        scene.objects.iter().position(|object| object.name == whole)
    };
    let [mut first, mut second] = deepest.bodies.map(|body| {
        let name = world.partner_name(body);
        (index(name), name.to_owned())
    });
    if first.0 < second.0 {
        // The error names the object that was placed last first.
        std::mem::swap(&mut first, &mut second);
    }
    if let (Some(index), None) = (first.0, second.0) {
        // Only the colliders of the robot belong to no object.
        let (object, part) = (first.1, second.1);
        return Err(SceneBuildError::InRobot { object, part, depth: deepest.depth }.of(&scene.objects[index]));
    }
    let place = |index: Option<usize>| index.map_or(String::new(), |i| scene.objects[i].placed_at.clone());
    // Most objects are placed by the lowest point of their shape, on something.
    let free = first.0.map(|index| &scene.objects[index].asset);
    let free = free.filter(|asset| matches!(asset.body, Body::Soft(_) | Body::Rigid { .. }));
    let lowest = free.map_or(0.0, |asset| -asset.shape.bounds().min.z);
    let error = SceneBuildError::Overlap {
        below_origin: Some(lowest).filter(|lowest| *lowest >= 0.5 * deepest.depth && *lowest > MAX_OVERLAP),
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
pub(super) fn check_base(scene: &Scene) -> Result<(), SceneBuildError> {
    let movable = |object: &&Object| matches!(object.asset.body, Body::Soft(_) | Body::Rigid { .. });
    for object in scene.objects.iter().filter(movable) {
        let column_o = object.pose_w.inverse() * scene.base_w;
        let steps = ((BASE_HIGH - BASE_LOW) / BASE_RADIUS).ceil() as usize;
        let inside = (0..=steps).any(|step| {
            let z = BASE_LOW + (BASE_HIGH - BASE_LOW) * step as f64 / steps as f64;
            object.asset.shape.distance(&(column_o * nalgebra::Point3::new(0.0, 0.0, z)).coords) < BASE_RADIUS
        });
        if inside {
            return Err(SceneBuildError::InBase(object.name.clone()).of(object));
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
) -> Result<(), SceneBuildError> {
    let asset = &object.asset;
    if let Some(what) = problem(object, cache) {
        return Err(SceneBuildError::Material { asset: asset.name.clone(), what });
    }
    let collider = |world: &World, parent: BodyId, pose_in_parent| {
        cache.shape(&asset.shape).collider(world, &object.name, parent, pose_in_parent, asset.friction)
    };
    let (mut parts, mut fem_model) = (Vec::new(), None);
    let (body, colliders) = match &asset.body {
        Body::Soft(material) => {
            let model = cache.model(object, material)?;
            let others = instances.iter().filter_map(|instance| instance.model.as_ref());
            let nodes = model.mesh.nodes.len() + others.map(|model| model.mesh.nodes.len()).sum::<usize>();
            if nodes > MAX_NODES {
                return Err(SceneBuildError::Nodes(nodes));
            }
            fem_model = Some(model.clone());
            let surface: Arc<dyn ContactSurface> = cache.shape(&asset.shape);
            let id = world.add_soft(&object.name, model, Some(surface), &object.pose_w, asset.friction);
            (id.into(), Vec::new())
        }
        Body::Rigid { density } => {
            let m = cache.mass(&asset.shape, *density);
            let body = RigidState::new(&object.pose_w, m.com, m.mass, m.inertia)
                .map_err(|source| SceneBuildError::Rigid { asset: asset.name.clone(), source })?;
            let body = BodyId::Rigid(world.add_rigid(&object.name, body));
            let collider = collider(world, body, Pose::identity());
            (body, vec![world.add_collider(collider)])
        }
        Body::Articulated(asset_parts) => {
            let (articulation, added) = add_articulated(world, object, asset_parts, instances.len(), cache)?;
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
        model: fem_model,
        bounds: cache.bounds(&asset.shape),
        settled: None,
        part: None,
    });
    instances.extend(parts);
    Ok(())
}

/// Adds the parts of an articulated object to the world. `base` is the index of the whole object.
fn add_articulated(
    world: &mut World,
    object: &Object,
    parts: &[MovingPart],
    base: usize,
    cache: &AssetCache,
) -> Result<(ArticulationId, Vec<ObjectInstance>), SceneBuildError> {
    for part in parts {
        if let Some(wall) = cache.shape(&part.asset.shape).wall() {
            let mm = tenths_of_mm(wall);
            let what =
                too_thin(&format!("part {}: its walls are about {mm} mm thick", part.name), MIN_PART_WALL);
            return Err(SceneBuildError::Material { asset: object.asset.name.clone(), what });
        }
    }
    let links = parts.iter().map(|part| link(part, parts, cache)).collect();
    let tree = JointTree { links, base_w: object.pose_w };
    tree.validate().map_err(|source| SceneBuildError::Joints { object: object.name.clone(), source })?;
    let drives = vec![None; parts.len()];
    let articulation = world.add_articulation(&object.name, tree, &object.joints, drives, true);
    let instances = parts.iter().enumerate().map(|(index, part)| {
        let name = format!("{}.{}", object.name, part.name);
        let link = LinkId { articulation, index };
        let pose_in_link = Pose::from(-part.joint.origin_o);
        let shape = cache.shape(&part.asset.shape);
        let collider = shape.collider(world, &name, link.into(), pose_in_link, part.asset.friction);
        ObjectInstance {
            name,
            asset: part.asset.clone(),
            body: link.into(),
            start_w: world.link_pose(link) * pose_in_link,
            colliders: vec![world.add_collider(collider)],
            model: None,
            bounds: cache.bounds(&part.asset.shape),
            settled: None,
            part: Some(ArticulatedPart { object: base, name: part.name.clone(), joint: part.joint.clone() }),
        }
    });
    Ok((articulation, instances.collect()))
}

/// Link of a part. Its frame is that of the object, translated to the origin of the joint.
fn link(part: &MovingPart, parts: &[MovingPart], cache: &AssetCache) -> Link {
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
