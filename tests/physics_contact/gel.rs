//! Gel pads against rigid bodies.

use softvt::{
    geometry::{Pose, Vec3, shape::Shape},
    physics::{BodyId, ColliderId, ContactPartner, KinematicId, RigidId, World, contact::Friction},
    robot::{Side, pads::PadSurface, tactile::GelSpec},
};

use crate::scene::*;

/// Two prescribed pads whose apexes are `apart` (m) from each other along y, at height z.
struct Hand {
    frames: [KinematicId; 2],
    pads: [ColliderId; 2],
}

fn pad_pose(side: Side, apart: f64, lift: f64) -> Pose {
    let sign = if side == Side::Left { 1.0 } else { -1.0 };
    // Pad z looks along −y (left) or y (right); pad x points up.
    let turn = softvt::robot::pads::pad_pose_in_finger(side).rotation;
    Pose::from_parts(Vec3::new(0.0, sign * 0.5 * apart, lift).into(), turn)
}

impl Hand {
    fn new(world: &mut World, apart: f64, lift: f64) -> Self {
        let frames = Side::BOTH.map(|side| world.add_kinematic(pad_pose(side, apart, lift)));
        let pads = frames.map(|frame| {
            let pad = PadSurface::default();
            let layer = pad.layer(&GelSpec::default());
            world.add_collider(pad.collider(
                "pad",
                frame.into(),
                Pose::identity(),
                friction(1.5, 1.2),
                &layer,
            ))
        });
        Self { frames, pads }
    }

    /// Moves both pads straight to a width and height within `seconds`, starting and ending gently.
    fn go(&self, world: &mut World, from: (f64, f64), to: (f64, f64), seconds: f64) {
        let steps = (seconds / world.params.dt).round() as usize;
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let u = share * share * (3.0 - 2.0 * share);
            for (side, frame) in Side::BOTH.into_iter().zip(self.frames) {
                let at = |a: f64, b: f64| a + (b - a) * u;
                world.move_kinematic(frame, pad_pose(side, at(from.0, to.0), at(from.1, to.1)));
            }
            world.step().expect("a step that converges");
        }
    }

    fn force(&self, world: &World, body: RigidId) -> [f64; 2] {
        self.pads.map(|pad| world.contact(body, pad).normal_force)
    }
}

/// A body of 0.2 kg on a floor, squeezed `depth` m by each pad at its middle height.
fn grasped(shape: &Shape, pose: Pose, width: f64, depth: f64) -> (World, RigidId, Hand, f64) {
    grasped_of(shape, pose, width, depth, friction(0.6, 0.5))
}

/// The same of a surface of any friction.
fn grasped_of(
    shape: &Shape,
    pose: Pose,
    width: f64,
    depth: f64,
    surface: Friction,
) -> (World, RigidId, Hand, f64) {
    let mut world = world();
    floor(&mut world, friction(0.6, 0.5));
    let body = rigid(&mut world, shape, 0.2, pose, surface);
    let lift = pose.translation.vector.z;
    let hand = Hand::new(&mut world, width + 0.004, lift);
    run(&mut world, 0.2);
    let shut = width - 2.0 * depth;
    hand.go(&mut world, (width + 0.004, lift), (shut, lift), 0.2);
    // Until the springs' damping has died away.
    run(&mut world, 0.3);
    (world, body, hand, shut)
}

#[test]
fn round_and_bumpy_bodies_are_held_at_rest() {
    // Their normals are tilted against those of the pads, and a bump presses more than what is around it.
    let ball = |radius: f64, y: f64| Shape::Sphere { radius }.translated(Vec3::new(0.004, y, 0.004));
    let bumpy = Shape::Union(vec![cuboid(0.03, 0.03, 0.03), ball(1.5e-3, 0.014), ball(1.5e-3, -0.014)]);
    for (name, shape, width, depth) in [
        ("small ball", Shape::Sphere { radius: 0.01 }, 0.02, 8e-4),
        ("ball", Shape::Sphere { radius: 0.02 }, 0.04, 5e-4),
        ("bumps", bumpy, 0.031, 6e-4),
    ] {
        for rate in [60.0, 240.0] {
            let mut world = world();
            world.params.dt = 1.0 / rate;
            world.gravity = Vec3::zeros();
            let body = rigid(&mut world, &shape, 0.05, Pose::identity(), friction(0.6, 0.5));
            let hand = Hand::new(&mut world, width + 0.002, 0.0);
            hand.go(&mut world, (width + 0.002, 0.0), (width - 2.0 * depth, 0.0), 0.5);
            world.gravity = Vec3::new(0.0, 0.0, -GRAVITY);
            run(&mut world, 1.0);
            let before = world.rigid(body).state.pose_w;
            run(&mut world, 2.0);
            let (now, v) = (world.rigid(body).state.pose_w, world.rigid(body).state.v.norm());
            let crept = (now.translation.vector - before.translation.vector).norm();
            let force = hand.force(&world, body);
            assert!(force[0] > 0.5 && force[1] > 0.5, "{name}, {rate} Hz: held with {force:?} N");
            assert!(crept < 1e-5 && v < 2e-4, "{name}, {rate} Hz: crept {crept} m, moves at {v} m/s");
        }
    }
}

#[test]
fn a_rigid_box_is_grasped_lifted_and_held_without_creep() {
    let can = Shape::Cylinder { radius: 0.025, half_height: 0.03 };
    for (name, shape, height) in [("box", cuboid(0.04, 0.05, 0.04), 0.02), ("can", can, 0.03)] {
        let (mut world, body, hand, shut) = grasped(&shape, at(0.0, 0.0, height), 0.05, 1.5e-4);
        hand.go(&mut world, (shut, height), (shut, height + 0.2), 1.0);
        run(&mut world, 0.3);
        let place = |world: &World| world.rigid(body).state.pose_w;
        let before = place(&world);
        assert!((before.translation.vector.z - height - 0.2).abs() < 1e-3, "{name} at {before}");
        run(&mut world, 5.0);
        let now = place(&world);
        let crept = (now.translation.vector - before.translation.vector).norm();
        let turned = now.rotation.angle_to(&before.rotation);
        eprintln!("{name}: crept {crept:.2e} m, turned {turned:.2e} rad, {:?} N", hand.force(&world, body));
        assert!(crept < 1e-6 && turned < 1e-5, "{name} crept {crept} m, turned {turned} rad");
    }
}

#[test]
fn a_body_heavier_than_the_friction_capacity_slides_out_of_the_pads() {
    // 0.2 kg need 0.66 N per pad at μ 1.5; 20 µm give 0.6 N on the dome of a flat box.
    let (mut world, body, hand, shut) = grasped(&cuboid(0.04, 0.05, 0.04), at(0.0, 0.0, 0.02), 0.05, 1.5e-5);
    let force: f64 = hand.force(&world, body).iter().sum();
    assert!(force > 0.0 && 1.5 * force < 0.2 * GRAVITY, "{force} N");
    hand.go(&mut world, (shut, 0.02), (shut, 0.12), 0.5);
    run(&mut world, 0.3);
    let z = world.rigid(body).state.pose_w.translation.vector.z;
    assert!(z < 0.021, "carried to {z} m");
}

#[test]
fn a_patch_has_the_friction_of_its_pair_held_and_sliding() {
    let shape = cuboid(0.04, 0.05, 0.04);
    // Pads have 1.5 and 1.2; each of the two is the larger one's.
    for (surface, held, sliding) in [((0.1, 0.05), 1.5, 1.2), ((2.0, 1.7), 2.0, 1.7), ((1.6, 1.1), 1.6, 1.2)]
    {
        let of = friction(surface.0, surface.1);
        let (mut world, _, hand, shut) = grasped_of(&shape, at(0.0, 0.0, 0.02), 0.05, 1.5e-5, of);
        let mu = |world: &World| world.patch(hand.pads[0]).points[0].mu;
        assert!((mu(&world) - held).abs() < 1e-12, "{surface:?}: held with {}", mu(&world));
        // Too weak a grip to lift the body: the pads slide up on it, at 60 mm/s.
        for step in 1..=10 {
            for (side, frame) in Side::BOTH.into_iter().zip(hand.frames) {
                world.move_kinematic(frame, pad_pose(side, shut, 0.02 + 1e-3 * f64::from(step)));
            }
            world.step().expect("a step that converges");
        }
        assert!((mu(&world) - sliding).abs() < 1e-12, "{surface:?}: slides with {}", mu(&world));
    }
}

#[test]
fn the_load_of_a_box_that_covers_part_of_a_pad_changes_without_jumps_as_it_moves() {
    let shape = cuboid(0.04, 0.05, 0.04);
    let force = |shift: f64| {
        let (world, body, hand, _) = grasped(&shape, at(0.02 + shift, 0.0, 0.02), 0.05, 2e-4);
        hand.force(&world, body).iter().sum::<f64>()
    };
    let forces: Vec<f64> = (0..8).map(|i| force(1e-4 * f64::from(i))).collect();
    eprintln!("{forces:?}");
    let changes: Vec<f64> = forces.windows(2).map(|pair| pair[1] - pair[0]).collect();
    for pair in changes.windows(2) {
        assert!((pair[1] / pair[0] - 1.0).abs() < 0.1, "{forces:?}");
    }
}

#[test]
fn contacts_of_soft_and_rigid_bodies_are_recorded_alike() {
    let mut world = world();
    let ground = floor(&mut world, friction(0.6, 0.5));
    let shape = cuboid(0.05, 0.05, 0.05);
    let low = rigid(&mut world, &shape, 0.3, at(0.0, 0.0, 0.025), friction(0.6, 0.5));
    let high = rigid(&mut world, &shape, 0.2, at(0.0, 0.0, 0.075), friction(0.6, 0.5));
    let bun = fem_model(&cuboid(0.04, 0.04, 0.04), crumb(), 4, 0.002);
    let bun = soft(&mut world, &cuboid(0.04, 0.04, 0.04), &bun, at(0.0, 0.0, 0.12), friction(0.6, 0.5));
    run(&mut world, 1.5);
    let up = |on, partner| world.contact(on, partner).force_w.z;
    let bun_weight = world.soft(bun).state.model.total_mass() * GRAVITY;
    // The floor's collider is followed by one per body.
    let collider = |body: RigidId| ColliderId::new(1 + body.index());
    for (on, partner, expected) in [
        (BodyId::Rigid(low), ContactPartner::Collider(ground), 0.5 * GRAVITY + bun_weight),
        (BodyId::Rigid(low), ContactPartner::Collider(collider(high)), -0.2 * GRAVITY - bun_weight),
        (BodyId::Rigid(high), ContactPartner::Collider(collider(low)), 0.2 * GRAVITY + bun_weight),
        (BodyId::Rigid(high), ContactPartner::Soft(bun), -bun_weight),
        (BodyId::Soft(bun), ContactPartner::Collider(collider(high)), bun_weight),
    ] {
        let found = up(on, partner);
        assert!(
            (found / expected - 1.0).abs() < 2e-3,
            "{on:?} from {partner:?}: {found} N, not {expected} N"
        );
    }
}
