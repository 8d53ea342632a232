use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use softvt_geometry::{Pose, Quat};

pub(super) const BOX: Primitive = Primitive::Box { half: Vec3::new(0.03, 0.02, 0.05) };
pub(super) const CAN: Primitive = Primitive::Cylinder { radius: 0.033, half_height: 0.05 };
const PILL: Primitive = Primitive::Capsule { radius: 0.015, half_height: 0.03 };
pub(super) const BALL: Primitive = Primitive::Sphere { radius: 0.025 };
const ALL: [Primitive; 5] = [Primitive::Plane, BOX, CAN, PILL, BALL];

pub(super) fn meet(
    a: &Primitive,
    pose_a: &Pose,
    b: &Primitive,
    pose_b: &Pose,
    margin: f64,
) -> Vec<ManifoldPoint> {
    let mut out = Vec::new();
    let placed = |shape: &Primitive, pose: &Pose| Placed { shape: *shape, pose: *pose };
    manifold(&placed(a, pose_a), &placed(b, pose_b), margin, &mut out);
    out
}

/// The point of a primitive farthest along `direction` (unit, world).
pub(super) fn support(shape: &Primitive, pose: &Pose, direction: &Vec3) -> Vec3 {
    separating_axis::support(&Placed { shape: *shape, pose: *pose }, direction)
}

/// True if a point moves over the material as the bodies roll.
pub(super) fn is_non_material(point: &ManifoldPoint) -> bool {
    point.feature & NON_MATERIAL != 0
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

fn turned(pose: Pose, turn: Vec3) -> Pose {
    pose * Quat::from_scaled_axis(turn)
}

fn area(points: &[ManifoldPoint]) -> f64 {
    points.iter().map(|point| point.area).sum()
}

/// A random pose of `b` in which it penetrations `a` by `depth` along some direction, or nearly so.
fn touching(rng: &mut ChaCha8Rng, a: &Primitive, b: &Primitive, depth: f64) -> (Pose, Pose) {
    let mut unit = || {
        let v = Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        v.normalize()
    };
    let (turn_a, turn_b, mut n) = (unit() * 2.0, unit() * 2.0, unit());
    let pose_a = Pose::new(unit() * 0.3, turn_a);
    if matches!(a, Primitive::Plane) {
        n = pose_a.rotation * Vec3::z();
    }
    let mut pose_b = Pose::new(Vec3::zeros(), turn_b);
    let shift = support(a, &pose_a, &n) - support(b, &pose_b, &-n) - n * depth;
    pose_b.translation.vector += shift;
    (pose_a, pose_b)
}

fn pairs() -> impl Iterator<Item = (Primitive, Primitive)> {
    ALL.into_iter().enumerate().flat_map(|(i, a)| ALL[i..].iter().map(move |&b| (a, b))).skip(1)
}

#[test]
fn a_box_flat_on_a_plane_stands_on_its_four_corners() {
    let points = meet(&Primitive::Plane, &at(0.0, 0.0, 0.1), &BOX, &at(0.2, 0.1, 0.149), 0.005);
    assert_eq!(points.len(), 4);
    for point in &points {
        assert!((point.gap + 0.001).abs() < 1e-15 && point.normal_w == Vec3::z());
        assert!((point.area - 0.03 * 0.02).abs() < 1e-18);
        let corner = point.position_w - Vec3::new(0.2, 0.1, 0.0995);
        assert!((corner.abs() - Vec3::new(0.03, 0.02, 0.0)).norm() < 1e-15);
    }
}

#[test]
fn turned_square_on_square_meets_in_the_octagon() {
    let square = Primitive::Box { half: Vec3::new(0.02, 0.02, 0.01) };
    let upper = turned(at(0.0, 0.0, 0.0205), Vec3::z() * std::f64::consts::FRAC_PI_4);
    let points = meet(&square, &at(0.0, 0.0, 0.0), &square, &upper, 0.002);
    assert_eq!(points.len(), 8);
    let octagon = 2.0 * (2f64.sqrt() - 1.0) * 0.04 * 0.04;
    assert!((area(&points) - octagon).abs() < 1e-12);
    assert!(
        points
            .iter()
            .all(|point| (point.gap - 0.0005).abs() < 1e-12 && (point.normal_w - Vec3::z()).norm() < 1e-12)
    );
    let mut names: Vec<u32> = points.iter().map(|point| point.feature).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), 8);
}

#[test]
fn flush_boxes_keep_the_names_of_their_points_under_rounding() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let cube = Primitive::Box { half: Vec3::repeat(0.02) };
    let names =
        |pose: &Pose| meet(&cube, &Pose::identity(), &cube, pose, 0.001).iter().map(|p| p.feature).collect();
    let expected: Vec<u32> = names(&at(0.0, 0.0, 0.04));
    assert_eq!(expected.len(), 4);
    for _ in 0..200 {
        let mut jitter = || Vec3::from_fn(|_, _| rng.random_range(-1e-8..1e-8));
        let (shift, turn) = (jitter(), jitter());
        let found: Vec<u32> = names(&turned(at(shift.x, shift.y, 0.04 + shift.z), turn));
        assert_eq!(found, expected);
    }
}

#[test]
fn crossed_edges_touch_in_one_point() {
    let cube = Primitive::Box { half: Vec3::repeat(0.02) };
    let lower = turned(at(0.0, 0.0, 0.0), Vec3::x() * std::f64::consts::FRAC_PI_4);
    let height = 2.0 * 0.02 * 2f64.sqrt() - 0.0003;
    let upper = turned(at(0.001, 0.002, height), Vec3::y() * std::f64::consts::FRAC_PI_4);
    let points = meet(&cube, &lower, &cube, &upper, 0.0002);
    assert_eq!(points.len(), 1);
    assert!((points[0].gap + 0.0003).abs() < 1e-12);
    assert!((points[0].position_w - Vec3::new(0.001, 0.0, 0.5 * height + 0.0)).xy().norm() < 2.1e-3);
    assert!((points[0].normal_w - Vec3::z()).norm() < 1e-12);
}

#[test]
fn a_can_stands_on_its_whole_rim_and_leans_on_its_lowest_point() {
    let standing = meet(&Primitive::Plane, &Pose::identity(), &CAN, &at(0.0, 0.0, 0.0499), 0.005);
    assert_eq!(standing.len(), feature::RIM_POINTS as usize);
    let polygon = 0.5
        * f64::from(feature::RIM_POINTS)
        * 0.033f64.powi(2)
        * (std::f64::consts::TAU / f64::from(feature::RIM_POINTS)).sin();
    assert!((area(&standing) - polygon).abs() < 1e-15);
    assert!(
        standing
            .iter()
            .all(|p| (p.position_w.xy().norm() - 0.033).abs() < 1e-15 && (p.gap + 1e-4).abs() < 1e-15)
    );
    for heading in [0.0f64, 0.13, 2.0] {
        let tilt = Vec3::new(-heading.sin(), heading.cos(), 0.0) * 0.3;
        let points =
            meet(&Primitive::Plane, &Pose::identity(), &CAN, &turned(at(0.0, 0.0, 0.05), tilt), 0.01);
        assert_eq!(points.len(), 1);
        let gap = 0.05 - 0.05 * 0.3f64.cos() - 0.033 * 0.3f64.sin();
        assert!((points[0].gap - gap).abs() < 1e-15 && is_non_material(&points[0]));
    }
}

#[test]
fn a_lying_can_and_a_lying_capsule_rest_on_the_ends_of_their_lowest_line() {
    for (primitive, radius, half) in [(CAN, 0.033, 0.05), (PILL, 0.015, 0.03)] {
        for roll in [0.0, 0.7] {
            let lying =
                at(0.0, 0.0, radius - 1e-4) * Quat::from_scaled_axis(Vec3::y() * std::f64::consts::FRAC_PI_2);
            let pose = lying * Quat::from_scaled_axis(Vec3::z() * roll);
            for (floor, floor_w) in [(Primitive::Plane, Pose::identity()), (BOX, at(0.0, 0.0, -0.05))] {
                let points = meet(&floor, &floor_w, &primitive, &pose, 0.002);
                let long = matches!(floor, Primitive::Plane) || half < 0.03 + 1e-9;
                let reach: f64 = if long { half } else { 0.03 };
                assert_eq!(points.len(), 2, "{primitive:?} on {floor:?}");
                for p in &points {
                    assert!(
                        (p.position_w.x.abs() - reach).abs() < 1e-9 && p.position_w.y.abs() < 1e-9,
                        "{:?}",
                        p.position_w
                    );
                    assert!((p.gap + 1e-4).abs() < 1e-9 && is_non_material(p));
                }
            }
        }
    }
}

#[test]
fn the_gap_is_the_largest_that_any_direction_shows() {
    // For convex bodies the gap is the maximum over directions of the distance of their supporting planes: no
    // sampled direction may beat the one found (but for the bias towards faces), and it must itself be attained.
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for (a, b) in pairs() {
        for depth in [0.0005, 0.003] {
            for _ in 0..60 {
                let (pose_a, pose_b) = touching(&mut rng, &a, &b, depth);
                let points = meet(&a, &pose_a, &b, &pose_b, 0.001);
                let gap = points.iter().map(|p| p.gap).fold(f64::INFINITY, f64::min);
                assert!(gap < 0.0, "{a:?} {b:?} overlap without a contact point ({gap})");
                let gap_along = |n: &Vec3| {
                    if matches!(a, Primitive::Plane) && (n - pose_a.rotation * Vec3::z()).norm() > 1e-9 {
                        return f64::NEG_INFINITY;
                    }
                    n.dot(&(support(&b, &pose_b, &-n) - support(&a, &pose_a, n)))
                };
                let least = points.iter().min_by(|p, q| p.gap.total_cmp(&q.gap)).expect("a point");
                assert!((gap_along(&least.normal_w) - gap).abs() < 1.2e-5, "{a:?} {b:?}: {gap} not attained");
                for _ in 0..400 {
                    let n = (least.normal_w + Vec3::from_fn(|_, _| rng.random_range(-1.5..1.5))).normalize();
                    assert!(
                        gap_along(&n) < gap + 0.011 * gap.abs() + 1.2e-5,
                        "{a:?} {b:?}: {} beats {gap}",
                        gap_along(&n)
                    );
                }
            }
        }
    }
}

#[test]
fn swapping_the_bodies_flips_the_normals_only() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for (a, b) in pairs() {
        for _ in 0..60 {
            let (pose_a, pose_b) = touching(&mut rng, &a, &b, 0.0004);
            let there = meet(&a, &pose_a, &b, &pose_b, 0.001);
            let back = meet(&b, &pose_b, &a, &pose_a, 0.001);
            // Pairs of a kind: two cylinders rim to rim keep a normal within PREFER_FACES_M of the best, whichever it
            // is; two boxes decide within SNAP_M, which may also name one corner twice.
            let (near, level, share) = if a == b { (2e-5, 2e-6, 0.01) } else { (1e-12, 1e-12, 1e-12) };
            assert!((area(&there) / area(&back) - 1.0).abs() < share, "{a:?} {b:?} {there:?} {back:?}");
            for p in &there {
                let twin = back.iter().any(|q| {
                    let apart = (p.position_w - q.position_w).norm().max((p.normal_w + q.normal_w).norm());
                    apart < near && (p.gap - q.gap).abs() < level
                });
                assert!(twin, "{a:?} {b:?}: {p:?} has no twin in {back:?}");
            }
        }
    }
}

/// Force and torque (about the world's origin) of a layer of unit modulus.
fn push(points: &[ManifoldPoint]) -> (Vec3, Vec3) {
    points.iter().fold((Vec3::zeros(), Vec3::zeros()), |(force, torque), p| {
        let f = p.normal_w * (p.area * (-p.gap).max(0.0));
        (force + f, torque + p.position_w.cross(&f))
    })
}

#[test]
fn resting_contacts_change_little_when_a_pose_changes_little() {
    // From every upright, lying and slightly tilted rest on a floor, in steps of 0.05 mrad and 0.5 µm.
    let floor = Primitive::Box { half: Vec3::new(0.2, 0.2, 0.01) };
    let floor_w = turned(at(0.01, 0.0, -0.01), Vec3::z() * 0.3);
    for primitive in [BOX, CAN, PILL, BALL] {
        for base in [Vec3::zeros(), Vec3::x() * std::f64::consts::FRAC_PI_2] {
            for ground in [(floor, floor_w), (Primitive::Plane, Pose::identity())] {
                let mut last: Option<(Vec3, Vec3)> = None;
                for k in 0..4000 {
                    let tilt = (f64::from(k) - 2000.0) * 5e-5;
                    let turn = Quat::from_scaled_axis(Vec3::new(0.3, 0.9, 0.1) * tilt)
                        * Quat::from_scaled_axis(base);
                    let mut pose = Pose::from_parts(nalgebra::Translation3::identity(), turn);
                    pose.translation.vector.z -= support(&primitive, &pose, &-Vec3::z()).z + 1e-4;
                    let now = push(&meet(&ground.0, &ground.1, &primitive, &pose, 0.002));
                    if let Some(before) = last {
                        let jump = (now.0 - before.0).norm();
                        let scale = 1e-4 * POINT_AREA.max(now.0.norm() / 1e-4);
                        assert!(
                            jump < 0.06 * scale,
                            "{primitive:?} at {tilt}: force jumps by {jump} of {scale}"
                        );
                        let twist = (now.1 - before.1).norm();
                        assert!(
                            twist < 0.06 * scale * 0.05,
                            "{primitive:?} at {tilt}: torque jumps by {twist}"
                        );
                    }
                    last = Some(now);
                }
            }
        }
    }
}

#[test]
fn a_can_on_a_box_is_carried_by_the_part_of_its_cap_over_the_box() {
    // Centre 10 mm inside of the edge: the points must span the overlap and hold the centre of mass.
    let table = Primitive::Box { half: Vec3::new(0.1, 0.1, 0.02) };
    let can_w = at(0.09, 0.01, 0.07 - 1e-5);
    let points = meet(&table, &Pose::identity(), &CAN, &can_w, 0.001);
    let far = points.iter().map(|p| p.position_w.x).fold(0.0, f64::max);
    assert!((far - 0.1).abs() < 1e-12, "reaches to {far}");
    assert!(points.iter().all(|p| (p.gap + 1e-5).abs() < 1e-12 && p.normal_w == Vec3::z()));
    // The segment of the disc cut off at 10 mm from the centre.
    let (r, d): (f64, f64) = (0.033, 0.01);
    let cut = r * r * (d / r).acos() - d * (r * r - d * d).sqrt();
    let expected = std::f64::consts::PI * r * r - cut;
    assert!((area(&points) / expected - 1.0).abs() < 0.015, "{} of {expected}", area(&points));
}

#[test]
fn stacked_cans_share_the_whole_disc() {
    let points = meet(&CAN, &Pose::identity(), &CAN, &turned(at(0.0, 0.0, 0.0999), Vec3::z() * 0.05), 0.001);
    let disc = std::f64::consts::PI * 0.033f64.powi(2);
    assert!((area(&points) / disc - 1.0).abs() < 0.03);
    let centre = points.iter().fold(Vec3::zeros(), |sum, p| sum + p.position_w * p.area) / area(&points);
    assert!(centre.xy().norm() < 1e-9 && points.iter().all(|p| (p.gap + 1e-4).abs() < 1e-12));
}

#[test]
fn a_can_leaning_on_a_wall_touches_its_edge_with_its_side() {
    let wall = Primitive::Box { half: Vec3::new(0.005, 0.1, 0.03) };
    let lean = 0.3f64;
    // Axis in the x–z plane; the side line passes through the wall's upper edge at (−0.005, ·, 0.03).
    let axis_w = Vec3::new(lean.sin(), 0.0, lean.cos());
    let side = Vec3::new(lean.cos(), 0.0, -lean.sin());
    let centre = Vec3::new(-0.005, 0.0, 0.03) - side * (0.033 - 2e-5) + axis_w * 0.01;
    let can_w = turned(Pose::from_parts(centre.into(), Quat::identity()), Vec3::y() * lean);
    let points = meet(&CAN, &can_w, &wall, &Pose::identity(), 0.0005);
    assert_eq!(points.len(), 1, "{points:?}");
    assert!((points[0].gap + 2e-5).abs() < 1e-7 && (points[0].normal_w - side).norm() < 1e-4, "{points:?}");
    assert!((points[0].position_w - Vec3::new(-0.005, 0.0, 0.03)).norm() < 5e-5, "{points:?}");
}

#[test]
fn contacts_in_any_attitude_change_little_when_a_pose_changes_little() {
    // Steps of 0.1 µm and 2 µrad. Where the best direction changes from one pair of features to another a jump is true
    // of any shallowest way out; it must be rare. Rims against edges and rims carry the noise of an iteration.
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for (a, b) in pairs() {
        let mut jumps = 0;
        for _ in 0..2000 {
            let (pose_a, mut pose_b) = touching(&mut rng, &a, &b, 0.0002);
            let before = push(&meet(&a, &pose_a, &b, &pose_b, 0.001)).0;
            let step = Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0)) * 1e-7;
            pose_b.translation.vector += step;
            pose_b.rotation = Quat::from_scaled_axis(step * 20.0) * pose_b.rotation;
            let after = push(&meet(&a, &pose_a, &b, &pose_b, 0.001)).0;
            jumps += u32::from((after - before).norm() > 0.05 * before.norm());
        }
        let allowed = match (a, b) {
            (Primitive::Box { .. }, Primitive::Box { .. }) => 2,
            (Primitive::Box { .. } | Primitive::Cylinder { .. }, Primitive::Cylinder { .. }) => 30,
            _ => 0,
        };
        assert!(jumps <= allowed, "{a:?} {b:?}: {jumps} jumps in 2000");
    }
}
