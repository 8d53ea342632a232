//! Compares the meshes of the robot with its kinematics and contact geometry.

use std::sync::OnceLock;

use super::*;
use softvt_common::disk_cache::DiskCache;
use softvt_geometry::Vec3;
use softvt_physics::joints::forward;
use softvt_robot::{
    GripperSpec, pads,
    panda::{self, ARM_DOFS},
};

fn meshes() -> &'static RobotMeshes {
    static MESHES: OnceLock<RobotMeshes> = OnceLock::new();
    MESHES.get_or_init(|| RobotMeshes::new(&DiskCache::DISABLED).expect("every part has a surface"))
}

/// The arm and two fingers.
const DOFS: usize = ARM_DOFS + 2;
/// Joint positions, none of them zero: joints 1 to 7, then the fingers half open.
const POSE: [f64; DOFS] = [0.3, -0.5, 0.2, -2.0, 0.4, 1.9, 0.7, 0.02, 0.02];

#[test]
fn every_link_is_drawn_once() {
    let objects = meshes().objects(ArticulationId::new(3), Pose::identity(), 9);
    assert!(objects.iter().all(|object| object.segmentation_id == 9 && object.casts_shadow));
    let drawn = |link: usize| {
        let body = BodyId::Link(LinkId { articulation: ArticulationId::new(3), index: link });
        objects.iter().filter(|object| object.body == body).count()
    };
    let mut expected = vec![1; DOFS];
    // The hand moves with the last link, and each finger has a gel.
    expected[panda::HAND_LINK] = 2;
    Side::BOTH.iter().for_each(|&side| expected[panda::finger_link(side)] = 2);
    assert_eq!((0..DOFS).map(drawn).collect::<Vec<_>>(), expected);
    assert_eq!(objects.iter().filter(|object| object.body == BodyId::World).count(), 1);
}

/// The solids of each part at joint positions `q`, with their link: 0 for the base, then counted from 1.
fn posed(q: &[f64; DOFS]) -> Vec<(usize, Vec<RenderSolid>)> {
    let poses = forward(&panda::tree(Pose::identity(), &GripperSpec::default()), q);
    let mut parts = vec![arm::base()];
    parts.extend(arm::links());
    parts.push(hand::hand());
    let place = |part: RobotPart| {
        let (index, pose) = part.link.map_or((0, Pose::identity()), |link| (link + 1, poses[link]));
        (index, part.solids.into_iter().map(|solid| solid.placed(&pose)).collect())
    };
    parts.into_iter().map(place).collect()
}

#[test]
fn links_are_connected_in_any_pose() {
    for q in [POSE, [0.0; DOFS], POSE.map(|q| -0.5 * q)] {
        let parts = posed(&q);
        let poses = forward(&panda::tree(Pose::identity(), &GripperSpec::default()), &q);
        for (link, pose) in poses.iter().enumerate().take(panda::ARM_DOFS) {
            // Some point on the axis of a joint belongs to both of its links.
            let shared = (-100..=100).any(|step| {
                let p = pose.transform_point(&Vec3::new(0.0, 0.0, f64::from(step) * 4e-3).into()).coords;
                let inside = |index: usize| {
                    let own = parts.iter().filter(|part| part.0 == index);
                    own.flat_map(|part| &part.1).any(|solid| solid.shape.distance(&p) < 2e-3)
                };
                inside(link) && inside(link + 1)
            });
            assert!(shared, "joint {}", link + 1);
        }
    }
}

#[test]
fn drawn_gels_match_the_contact_surfaces() {
    let pad = pads::PadSurface::default();
    for side in Side::BOTH {
        let to_pad = pads::pad_pose_in_finger(side).inverse();
        let mesh = hand::gel(side);
        let points: Vec<Vec3> =
            mesh.vertices.iter().map(|v| to_pad.transform_point(&(*v).into()).coords).collect();
        let dome: Vec<&Vec3> = points.iter().filter(|p| (p.z - pad.height(p.x, p.y)).abs() < 1e-12).collect();
        assert_eq!(dome.len(), 15 * 13);
        assert!(points.iter().all(|p| pad.edge_distance(p.x, p.y) < 1e-9 && p.z <= 1e-12));
        let reach = |axis: usize| points.iter().map(|p| p[axis]).fold(0.0, f64::max);
        assert!((reach(0) - 0.5 * pad.length).abs() < 1e-9 && (reach(1) - 0.5 * pad.width).abs() < 1e-9);
        // The dome faces away from the pad.
        for t in &mesh.triangles[..2 * 14 * 12] {
            let [a, b, c] = t.map(|v| points[v as usize]);
            assert!((b - a).cross(&(c - a)).z > 0.0);
        }
        let part = hand::finger(side);
        let in_front = part.solids.iter().filter(|solid| {
            solid.shape.distance(&pads::pad_pose_in_finger(side).translation.vector) < pad.thickness * 0.5
        });
        assert_eq!(in_front.count(), 0, "nothing is in front of the apex");
    }
}
