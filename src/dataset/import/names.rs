//! Which thing of another world is which object of ours.

use super::Standing;
use crate::{
    geometry::{Pose, Vec3},
    scene::{Body, Object, Place, Scene},
};

/// What is longer than this is the ground, m.
const GROUND: f64 = 0.5;
/// A thing whose own z axis is this near to the vertical stands as ours do, and its yaw is ours (cosine).
const UPRIGHT: f64 = 0.99;

/// Where the objects of `scene` stand by what is known of another world; none if its `target` is not among that.
///
/// A thing is an object of the same name, or of which the asset's name, or the object's, is the name's ending, behind a number
/// that tells things of one kind apart: the first of them is the first in the scene. A soft body without a name of ours is the
/// target.
pub fn places(scene: &Scene, target: &str, things: &[Standing]) -> Vec<Place> {
    let mut things: Vec<(&str, u32, &Standing)> = things.iter().map(|thing| numbered(thing)).collect();
    things.sort_by_key(|(_, number, _)| *number);
    let mut taken = vec![false; things.len()];
    let mut places = Vec::new();
    for object in scene.objects.iter().filter(|object| moves(object)) {
        let fits = |exact: bool, taken: &[bool]| {
            let asset = &object.asset.name;
            let ends = |stem: &str, name: &str| stem == name || stem.ends_with(&format!("_{name}"));
            (0..things.len()).find(|&i| {
                let (stem, _, thing) = things[i];
                let same = thing.name == object.name || stem == object.name;
                !taken[i] && (same || !exact && (ends(stem, asset) || ends(stem, &object.name)))
            })
        };
        let only_soft = || {
            let soft = |i: &usize| !taken[*i] && things[*i].2.soft;
            (0..things.len()).find(soft).filter(|_| object.name == target)
        };
        let found = fits(true, &taken).or_else(|| fits(false, &taken)).or_else(only_soft);
        if let Some(i) = found {
            taken[i] = true;
            places.push(place(scene, object, things[i].2));
        }
    }
    if places.iter().any(|place| place.name == target) { places } else { Vec::new() }
}

/// Whether an object may stand elsewhere.
fn moves(object: &&Object) -> bool {
    let size = object.asset.shape.bounds().size();
    !matches!(object.asset.body, Body::Scenery) && size.x.max(size.y) < GROUND
}

/// A thing's name without the number at its end, and the number.
fn numbered(thing: &Standing) -> (&str, u32, &Standing) {
    let split = thing.name.rsplit_once('_').and_then(|(stem, end)| Some((stem, end.parse().ok()?)));
    let (stem, number) = split.unwrap_or((&thing.name, 0));
    (stem, number, thing)
}

fn place(scene: &Scene, object: &Object, thing: &Standing) -> Place {
    let pose_w = if thing.in_base { scene.base_w * thing.pose } else { thing.pose };
    let at = pose_w.translation.vector;
    let upright = (pose_w.rotation * Vec3::z()).z > UPRIGHT;
    Place { name: object.name.clone(), xy: [at.x, at.y], yaw: (upright && !thing.soft).then(|| yaw(&pose_w)) }
}

/// Turn about the vertical, rad.
fn yaw(pose: &Pose) -> f64 {
    let x = pose.rotation * Vec3::x();
    x.y.atan2(x.x)
}
