//! Assignment of recorded object poses to the objects of a softvt scene.

use super::foreign::ForeignObjectPose;
use softvt_geometry::{Pose, Vec3};
use softvt_scene::{Body, Object, ObjectPlacement, Scene};

/// Objects longer than this are furniture and are not placed, m.
const FURNITURE_LENGTH: f64 = 0.5;
/// Cosine of the largest tilt at which an object's z axis counts as vertical, so that its yaw can be taken over.
const MIN_UPRIGHT_COSINE: f64 = 0.99;

/// Placements of the objects of `scene` according to `recorded` poses; empty if `target` is not among them.
///
/// Names are compared without a trailing number, which tells objects of one kind apart: the lowest number belongs to
/// the first such object of the scene. A recorded object matches if its name is the object's, or ends in the name of
/// the object or of its asset. A soft body that matches nothing is taken to be the target.
pub fn match_objects(scene: &Scene, target: &str, recorded: &[ForeignObjectPose]) -> Vec<ObjectPlacement> {
    let mut candidates: Vec<(&str, u32, &ForeignObjectPose)> = recorded.iter().map(numbered).collect();
    candidates.sort_by_key(|(_, number, _)| *number);
    let mut taken = vec![false; candidates.len()];
    let mut places = Vec::new();
    for object in scene.objects.iter().filter(is_placeable) {
        let fits = |exact: bool, taken: &[bool]| {
            let asset = &object.asset.name;
            let ends = |stem: &str, name: &str| stem == name || stem.ends_with(&format!("_{name}"));
            (0..candidates.len()).find(|&i| {
                let (stem, _, recorded) = candidates[i];
                let same = recorded.name == object.name || stem == object.name;
                !taken[i] && (same || !exact && (ends(stem, asset) || ends(stem, &object.name)))
            })
        };
        let only_soft = || {
            let soft = |i: &usize| !taken[*i] && candidates[*i].2.is_soft;
            (0..candidates.len()).find(soft).filter(|_| object.name == target)
        };
        let found = fits(true, &taken).or_else(|| fits(false, &taken)).or_else(only_soft);
        if let Some(i) = found {
            taken[i] = true;
            places.push(place(scene, object, candidates[i].2));
        }
    }
    if places.iter().any(|place| place.name == target) { places } else { Vec::new() }
}

/// True for objects that may be placed elsewhere than in the layout.
fn is_placeable(object: &&Object) -> bool {
    let size = object.asset.shape.bounds().size();
    !matches!(object.asset.body, Body::Scenery) && size.x.max(size.y) < FURNITURE_LENGTH
}

/// Name without a trailing number, that number, and the object.
fn numbered(recorded: &ForeignObjectPose) -> (&str, u32, &ForeignObjectPose) {
    let split = recorded.name.rsplit_once('_').and_then(|(stem, end)| Some((stem, end.parse().ok()?)));
    let (stem, number) = split.unwrap_or((&recorded.name, 0));
    (stem, number, recorded)
}

fn place(scene: &Scene, object: &Object, recorded: &ForeignObjectPose) -> ObjectPlacement {
    let pose_w = if recorded.in_base { scene.base_w * recorded.pose } else { recorded.pose };
    let at = pose_w.translation.vector;
    let upright = (pose_w.rotation * Vec3::z()).z > MIN_UPRIGHT_COSINE;
    ObjectPlacement {
        name: object.name.clone(),
        xy: [at.x, at.y],
        yaw: (upright && !recorded.is_soft).then(|| yaw(&pose_w)),
    }
}

/// Rotation about the vertical, rad.
fn yaw(pose: &Pose) -> f64 {
    let x = pose.rotation * Vec3::x();
    x.y.atan2(x.x)
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, sync::Arc};

    use super::*;
    use softvt_geometry::{Aabb, Quat, shape::Shape};
    use softvt_physics::contact::Friction;
    use softvt_scene::{Asset, Lighting};

    fn object(name: &str, asset: &str, size: f64) -> Object {
        let asset = Asset {
            name: asset.to_owned(),
            shape: Shape::Box { half: Vec3::repeat(size / 2.0) },
            body: Body::Rigid { density: 100.0 },
            friction: Friction::default(),
            visuals: Vec::new(),
            hints: BTreeMap::new(),
        };
        Object::new(name, Arc::new(asset), Pose::translation(0.0, 0.0, 0.25))
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
            workspace: Aabb { min: Vec3::zeros(), max: Vec3::zeros() },
            lighting: Lighting::default(),
            cameras: Vec::new(),
        }
    }

    fn object_pose(name: &str, x: f64, is_soft: bool) -> ForeignObjectPose {
        let turn = Quat::from_axis_angle(&Vec3::z_axis(), 0.3);
        ForeignObjectPose {
            name: name.to_owned(),
            pose: Pose::from_parts(Vec3::new(x, 0.1, 0.9).into(), turn),
            in_base: true,
            is_soft,
        }
    }

    fn named(places: &[ObjectPlacement]) -> Vec<(&str, f64)> {
        places.iter().map(|place| (place.name.as_str(), (100.0 * place.xy[0]).round())).collect()
    }

    #[test]
    fn objects_of_one_kind_are_matched_in_the_order_of_their_numbers() {
        let recorded = [
            object_pose("my_red_cup_2", 0.9, false),
            object_pose("table_1", 0.0, false),
            object_pose("my_red_cup_1", 0.7, false),
        ];
        let found = match_objects(&scene(), "right", &recorded);
        assert_eq!(named(&found), [("left", 10.0), ("right", 30.0)]);
        assert!((found[0].yaw.unwrap() - 0.3).abs() < 1e-12);
        let mut moved = scene();
        softvt_scene::InitialStateOverride { joints: Some([0.5; 7]), places: found }.apply(&mut moved);
        let at = moved.objects[2].pose_w.translation.vector;
        assert!((at - Vec3::new(0.3, 0.1, 0.25)).norm() < 1e-12, "the height is that of the layout: {at}");
        assert_eq!((moved.start_q, &moved.objects[0]), ([0.5; 7], &scene().objects[0]));
    }

    #[test]
    fn an_unknown_soft_object_is_the_target_and_without_the_target_nothing_is_placed() {
        let recorded = [object_pose("pastry_7", 0.7, true), object_pose("china_1", 0.8, false)];
        let found = match_objects(&scene(), "left", &recorded);
        assert_eq!(named(&found), [("left", 10.0), ("saucer", 20.0)]);
        assert_eq!(found[0].yaw, None, "its orientation is not known");
        assert_eq!(match_objects(&scene(), "left", &recorded[1..]), []);
    }

    #[test]
    fn an_object_on_its_side_keeps_the_yaw_of_the_layout() {
        let mut lying = object_pose("red_cup_1", 0.7, false);
        lying.pose.rotation *= Quat::from_axis_angle(&Vec3::x_axis(), 1.57);
        assert_eq!(match_objects(&scene(), "left", &[lying])[0].yaw, None);
    }
}
