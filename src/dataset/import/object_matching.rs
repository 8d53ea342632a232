//! Which thing of another world is which object of ours.

use super::ForeignObjectPose;
use crate::{
    geometry::{Pose, Vec3},
    scene::{Body, Object, ObjectPlacement, Scene},
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
pub fn match_objects(scene: &Scene, target: &str, things: &[ForeignObjectPose]) -> Vec<ObjectPlacement> {
    let mut things: Vec<(&str, u32, &ForeignObjectPose)> = things.iter().map(numbered).collect();
    things.sort_by_key(|(_, number, _)| *number);
    let mut taken = vec![false; things.len()];
    let mut places = Vec::new();
    for object in scene.objects.iter().filter(moves) {
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
fn numbered(thing: &ForeignObjectPose) -> (&str, u32, &ForeignObjectPose) {
    let split = thing.name.rsplit_once('_').and_then(|(stem, end)| Some((stem, end.parse().ok()?)));
    let (stem, number) = split.unwrap_or((&thing.name, 0));
    (stem, number, thing)
}

fn place(scene: &Scene, object: &Object, thing: &ForeignObjectPose) -> ObjectPlacement {
    let pose_w = if thing.in_base { scene.base_w * thing.pose } else { thing.pose };
    let at = pose_w.translation.vector;
    let upright = (pose_w.rotation * Vec3::z()).z > UPRIGHT;
    ObjectPlacement {
        name: object.name.clone(),
        xy: [at.x, at.y],
        yaw: (upright && !thing.soft).then(|| yaw(&pose_w)),
    }
}

/// Turn about the vertical, rad.
fn yaw(pose: &Pose) -> f64 {
    let x = pose.rotation * Vec3::x();
    x.y.atan2(x.x)
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, sync::Arc};

    use super::*;
    use crate::{
        geometry::{Quat, shape::Shape},
        physics::contact::Friction,
        scene::{Asset, Lighting, Region},
    };

    fn object(name: &str, asset: &str, size: f64) -> Object {
        let asset = Asset {
            name: asset.to_owned(),
            shape: Shape::Box { half: Vec3::repeat(size / 2.0) },
            body: Body::Rigid { density: 100.0 },
            friction: Friction::default(),
            visuals: Vec::new(),
            hints: BTreeMap::new(),
        };
        let pose_w = Pose::translation(0.0, 0.0, 0.25);
        let placed_at = String::new();
        Object { name: name.to_owned(), asset: Arc::new(asset), pose_w, joints: Vec::new(), placed_at }
    }

    fn scene() -> Scene {
        Scene {
            objects: vec![
                object("table", "table", 1.0),
                object("left", "red_cup", 0.1),
                object("right", "red_cup", 0.1),
                object("saucer", "china", 0.1),
            ],
            base_w: Pose::translation(-0.6, 0.0, 0.0),
            start_q: [0.0; 7],
            gravity: Vec3::zeros(),
            workspace: Region { min: Vec3::zeros(), max: Vec3::zeros() },
            lighting: Lighting::default(),
            cameras: Vec::new(),
        }
    }

    fn thing(name: &str, x: f64, soft: bool) -> ForeignObjectPose {
        let turn = Quat::from_axis_angle(&Vec3::z_axis(), 0.3);
        ForeignObjectPose {
            name: name.to_owned(),
            pose: Pose::from_parts(Vec3::new(x, 0.1, 0.9).into(), turn),
            in_base: true,
            soft,
        }
    }

    fn named(places: &[ObjectPlacement]) -> Vec<(&str, f64)> {
        places.iter().map(|place| (place.name.as_str(), (100.0 * place.xy[0]).round())).collect()
    }

    #[test]
    fn things_of_one_kind_are_taken_in_the_order_of_their_numbers() {
        let things = [
            thing("my_red_cup_2", 0.9, false),
            thing("table_1", 0.0, false),
            thing("my_red_cup_1", 0.7, false),
        ];
        let found = match_objects(&scene(), "right", &things);
        assert_eq!(named(&found), [("left", 10.0), ("right", 30.0)]);
        assert!((found[0].yaw.unwrap() - 0.3).abs() < 1e-12);
        let mut moved = scene();
        crate::scene::InitialState { joints: Some([0.5; 7]), places: found }.apply(&mut moved);
        let at = moved.objects[2].pose_w.translation.vector;
        assert!((at - Vec3::new(0.3, 0.1, 0.25)).norm() < 1e-12, "the height is the layout's: {at}");
        assert_eq!((moved.start_q, &moved.objects[0]), ([0.5; 7], &scene().objects[0]));
    }

    #[test]
    fn a_soft_thing_without_a_name_of_ours_is_the_target_and_without_the_target_nothing_is_placed() {
        let things = [thing("pastry_7", 0.7, true), thing("china_1", 0.8, false)];
        let found = match_objects(&scene(), "left", &things);
        assert_eq!(named(&found), [("left", 10.0), ("saucer", 20.0)]);
        assert_eq!(found[0].yaw, None, "how it is turned is not known");
        assert_eq!(match_objects(&scene(), "left", &things[1..]), []);
    }

    #[test]
    fn a_thing_that_lies_on_its_side_in_its_own_frame_keeps_our_yaw() {
        let mut lying = thing("red_cup_1", 0.7, false);
        lying.pose.rotation *= Quat::from_axis_angle(&Vec3::x_axis(), 1.57);
        assert_eq!(match_objects(&scene(), "left", &[lying])[0].yaw, None);
    }
}
