use super::*;
use crate::{
    KinematicId, LinkId, PhysicsParams, RigidId,
    fem::ElasticMaterial,
    joints::{JointKind, JointTree, Link},
    world::{FixedBuilder, RigidBodyBuilder, SoftBodyBuilder},
};
use softvt_geometry::{Mat3, Pose, Quat};

const LENGTH: f64 = 0.1;
const SIDE: f64 = 0.02;

/// A beam along x with `n` voxels across.
fn beam(n: usize, poisson: f64) -> SoftBodyBuilder {
    let rubber = ElasticMaterial::new(3e5, poisson, 300.0).expect("valid");
    let shape = Shape::cuboid(Vec3::new(LENGTH, SIDE, SIDE));
    SoftBodyBuilder::new(shape, rubber).resolution(5 * n).named("beam")
}

/// The part of the beam within `depth` of an end.
fn end(side: f64, depth: f64) -> Shape {
    let size = Vec3::new(2.0 * depth, 2.0 * SIDE, 2.0 * SIDE);
    Shape::cuboid(size).translated(Vec3::new(0.5 * side * LENGTH, 0.0, 0.0))
}

fn world(gravity: Vec3) -> World {
    let params = PhysicsParams { sleeping: false, ..PhysicsParams::default() };
    World::new(params, gravity)
}

/// Linear momentum, and angular momentum about the origin.
fn momenta(world: &World) -> (Vec3, Vec3) {
    let soft = world.soft_bodies().iter().flat_map(|soft| {
        let body = &soft.state;
        let nodes = body.x.iter().zip(&body.v).zip(&body.model.mass);
        nodes.map(|((x, v), m)| (v * *m, x.cross(v) * *m))
    });
    let rigid =
        world.rigid_bodies().iter().map(|rigid| (rigid.state.momentum(), rigid.state.angular_momentum()));
    soft.chain(rigid).fold((Vec3::zeros(), Vec3::zeros()), |sum, part| (sum.0 + part.0, sum.1 + part.1))
}

/// A strained, spinning beam with a heavy brick on its end.
fn thrown(params: PhysicsParams, spin: f64, stretch: f64) -> World {
    let mut world = World::new(params, Vec3::zeros());
    let soft = world.insert(beam(2, 0.4).at(0.3, 0.1, 1.0)).expect("a beam");
    let brick = RigidBodyBuilder::new(Shape::cuboid(Vec3::new(0.01, 0.04, 0.02)), 2e3);
    let rigid = world.insert(brick.at(0.3 + 0.5 * LENGTH + 0.005, 0.1, 1.0)).expect("a brick");
    world.attach(soft, &end(1.0, 1e-3), rigid).expect("an end face");
    let (w, centre) = (Vec3::new(0.3, 1.0, 0.2).normalize() * spin, world.soft(soft).state.centre());
    let drift = Vec3::new(0.1, -0.2, 0.05);
    world.set_soft_motion(soft, |x, v| {
        let r = *x - centre;
        *v = drift + w.cross(&r);
        *x += Vec3::new(0.0, -r.y, 5.0 * r.x * r.y) * stretch;
    });
    let state = &mut world.rigid_mut(rigid).state;
    state.v = drift + w.cross(&(state.pose_w.translation.vector - centre));
    state.w = w;
    world
}

#[test]
fn a_body_and_the_load_on_it_keep_their_momenta_and_gain_no_energy_in_flight() {
    for (spin, stretch, beta) in [(0.0, 0.1, 0.0), (2.0, 0.0, 5e-3), (10.0, 0.05, 5e-3), (20.0, 0.1, 0.0)] {
        let params = PhysicsParams { rayleigh_stiffness: beta, ..PhysicsParams::default() };
        let mut world = thrown(params, spin, stretch);
        let (start, first) = (momenta(&world), world.energy().total());
        let (mut last, mut gain) = (first, 0.0f64);
        for _ in 0..240 {
            world.step().expect("a step");
            let now = world.energy().total();
            gain = gain.max((now - last) / first);
            last = now;
        }
        let end = momenta(&world);
        // The elastic energy of the bonds is not counted.
        assert!(gain < 1e-5, "{spin}: {gain} of the energy");
        assert!((end.0 - start.0).norm() < 1e-10 * start.0.norm(), "{spin}: {start:?} {end:?}");
        assert!((end.1 - start.1).norm() < 1e-10 * start.1.norm(), "{spin}: {start:?} {end:?}");
    }
}

/// Deflection of the tip of a beam at rest under its weight, m.
fn sag(n: usize, poisson: f64, stiffening: f64) -> f64 {
    let mut world = world(Vec3::z() * -9.81);
    let soft = world.insert(beam(n, poisson)).expect("a beam");
    world.attach(soft, &end(-1.0, 1e-4), BodyId::World).expect("an end face");
    world.attachments[0].stiffness *= stiffening;
    world.run(3.0).expect("steps");
    let body = &world.soft(soft).state;
    let tip = body.model.mesh.nodes.iter().zip(&body.x).filter(|(rest, _)| rest.x > 0.5 * LENGTH - 1e-6);
    let (sum, count) = tip.fold((0.0, 0), |(sum, count), (rest, x)| (sum + rest.z - x.z, count + 1));
    sum / f64::from(count)
}

#[test]
fn a_clamped_beam_sags_as_if_its_clamp_were_ideal_and_as_timoshenko_says() {
    let weight = 300.0 * 9.81 * SIDE * SIDE;
    let bending = weight * LENGTH.powi(4) / (8.0 * 3e5 * SIDE.powi(4) / 12.0);
    let shear = weight * LENGTH * LENGTH / (2.0 * (10.0 / 12.0) * SIDE * SIDE * 1.5e5);
    for n in [1, 2, 4] {
        let off = sag(n, 0.0, 1.0) / (bending + shear) - 1.0;
        assert!(off.abs() < 0.015, "{n} across: off by {off}");
    }
    for (n, poisson) in [(1, 0.0), (4, 0.0), (2, 0.3), (2, 0.49)] {
        let (own, firm) = (sag(n, poisson, 1.0), sag(n, poisson, 100.0));
        assert!(
            (own / firm - 1.0).abs() < 1e-3,
            "{n} across, ν {poisson}: {own} m, {firm} m with firm bonds"
        );
    }
}

/// Largest distance of a bonded node from its anchor, m.
fn stretch(world: &World, id: AttachmentId) -> f64 {
    let attachment = world.attachment(id);
    let (pose, body) = (world.pose(attachment.to), &world.soft(attachment.soft).state);
    let anchor = |bond: &Bond| (pose * nalgebra::Point3::from(bond.anchor)).coords;
    attachment.bonds.iter().map(|bond| (body.x[bond.node as usize] - anchor(bond)).norm()).fold(0.0, f64::max)
}

#[test]
fn a_clamp_that_moves_and_turns_carries_the_body_along() {
    for rate in [60.0, 240.0] {
        let mut world = world(Vec3::zeros());
        world.params.dt = 1.0 / rate;
        let soft = world.insert(beam(2, 0.4).at(0.0, 0.3, 0.0)).expect("a beam");
        let frame = world.add_kinematic(Pose::translation(-0.2, 0.3, 0.0));
        let clamp = world.attach(soft, &end(-1.0, 1e-4), frame).expect("an end face");
        let start = world.pose(soft);
        let goal = |t: f64| {
            let turn = Quat::from_scaled_axis(Vec3::z() * (2.0 * t.min(1.0)));
            Pose::from_parts(Vec3::new(-0.2, 0.3 + 0.2 * t.min(1.0), 0.0).into(), turn)
        };
        let mut worst = 0.0f64;
        for step in 1..=(5.0 * rate) as u32 {
            world.move_kinematic(frame, goal(f64::from(step) / rate));
            world.step().expect("a step");
            worst = worst.max(stretch(&world, clamp));
        }
        let moved = goal(1.0) * Pose::translation(0.2, -0.3, 0.0) * start;
        let error = moved.inv_mul(&world.pose(soft));
        // It starts and stops at once, with 0.4 m/s at the clamp.
        assert!(worst < 1e-4, "{worst} m off at {rate} Hz");
        assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-9, "{error}");
    }
}

/// A hinge about y at the origin with a light link.
fn hinge() -> JointTree {
    let link = Link {
        name: "link".to_owned(),
        parent: None,
        placement: Pose::identity(),
        kind: JointKind::Revolute(-Vec3::y_axis()),
        mass: 0.01,
        com: Vec3::zeros(),
        inertia: Mat3::identity() * 1e-6,
        lower: -10.0,
        upper: 10.0,
        velocity_limit: 100.0,
        effort_limit: 10.0,
        friction: 0.0,
        damping: 0.0,
    };
    JointTree { links: vec![link], base_w: Pose::identity() }
}

#[test]
fn a_body_on_a_hinged_link_swings_never_higher_than_it_started() {
    for (rate, most) in [(60.0, 0.05), (240.0, 0.0125)] {
        let mut world = world(Vec3::z() * -9.81);
        world.params.dt = 1.0 / rate;
        let soft = world.insert(beam(2, 0.4).at(0.5 * LENGTH, 0.0, 0.0)).expect("a beam");
        let hinge = world.add_articulation("hinge", hinge(), &[0.0], vec![None], true);
        world.attach(soft, &end(-1.0, 1e-4), LinkId { articulation: hinge, index: 0 }).expect("an end face");
        let start = world.energy().total();
        let drop = world.mass(soft).expect("a mass") * 9.81 * 0.5 * LENGTH;
        let (mut highest, mut lowest) = (f64::NEG_INFINITY, f64::INFINITY);
        for step in 1..=(4.0 * rate) as u32 {
            world.step().expect("a step");
            let z = world.soft(soft).state.centre().z;
            (highest, lowest) = (highest.max(z), lowest.min(z));
            // Within a swing, the energy varies by an amount of the order of the step: velocities are those of the
            // middle of the steps.
            let gain = (world.energy().total() - start) / drop;
            assert!(gain < most, "{gain} of the drop at step {step} and {rate} Hz");
        }
        assert!(
            highest < 0.0 && lowest < -0.95 * 0.5 * LENGTH,
            "between {lowest} and {highest} m at {rate} Hz"
        );
    }
}

#[test]
fn a_hanging_load_pulls_with_its_weight_and_nothing_creeps_or_touches() {
    let mut world = world(Vec3::z() * -9.81);
    let soft = world.insert(beam(2, 0.4)).expect("a beam");
    // The end is inside of the block that holds it.
    let block = FixedBuilder::new(Shape::cuboid(Vec3::repeat(0.04)));
    world.insert(block.at(-0.5 * LENGTH - 0.01, 0.0, 0.0));
    let brick = RigidBodyBuilder::new(Shape::cuboid(Vec3::new(0.01, 0.02, 0.02)), 5e3);
    let rigid = world.insert(brick.at(0.5 * LENGTH + 0.005, 0.0, 0.0)).expect("a brick");
    let clamp = world.attach(soft, &end(-1.0, 0.01), BodyId::World).expect("an end");
    let load = world.attach(soft, &end(1.0, 1e-4), rigid).expect("an end face");
    world.run(10.0).expect("steps");
    let weight = |body: BodyId| Vec3::z() * (9.81 * world.mass(body).expect("a mass"));
    let (hung, all) = (weight(rigid.into()), weight(rigid.into()) + weight(soft.into()));
    assert!((world.attachment(load).force_w + hung).norm() < 1e-6 * all.z);
    assert!((world.attachment(clamp).force_w - all).norm() < 1e-6 * all.z);
    assert!(stretch(&world, clamp) < 1e-6);
    assert!(world.contacts(soft).is_empty() && world.contacts(rigid).is_empty());
    let place = world.rigid(rigid).state.pose_w;
    world.run(10.0).expect("steps");
    let moved = place.inv_mul(&world.rigid(rigid).state.pose_w);
    assert!(moved.translation.vector.norm() < 1e-8 && moved.rotation.angle() < 1e-6, "{moved}");
}

#[test]
fn bodies_that_are_attached_sleep_and_wake_together() {
    let mut world = World::with_gravity();
    let soft = world.insert(beam(1, 0.4)).expect("a beam");
    let brick = RigidBodyBuilder::new(Shape::cuboid(Vec3::new(0.01, 0.02, 0.02)), 1e3);
    let rigid = world.insert(brick.at(0.5 * LENGTH + 0.005, 0.0, 0.0)).expect("a brick");
    let frame = world.add_kinematic(Pose::identity());
    world.attach(soft, &end(-1.0, 1e-4), frame).expect("an end face");
    let load = world.attach(soft, &end(1.0, 1e-4), rigid).expect("an end face");
    let mut slept = 0;
    while !world.is_asleep(soft) {
        world.step().expect("a step");
        assert_eq!(world.is_asleep(soft), world.is_asleep(rigid));
        slept += 1;
        assert!(slept < 600, "never sleeps");
    }
    let weight = 9.81 * world.mass(rigid).expect("a mass");
    let force = world.attachment(load).force_w;
    assert!((force - Vec3::z() * -weight).norm() < 1e-3 * weight, "{force}");
    world.move_kinematic(frame, Pose::translation(0.0, 0.0, 1e-3));
    world.step().expect("a step");
    assert!(!world.is_asleep(soft) && !world.is_asleep(rigid));
}

#[test]
fn what_cannot_be_attached_is_an_error() {
    let mut world = World::with_gravity();
    let soft = world.insert(beam(1, 0.4)).expect("a beam");
    let other = world.insert(beam(1, 0.4).named("other").at(1.0, 0.0, 0.0)).expect("a beam");
    let half_ball = Shape::Sphere { radius: 0.02 }
        .subtract(Shape::cuboid(Vec3::repeat(0.1)).translated(Vec3::x() * 0.05));
    let ball = ElasticMaterial::new(3e4, 0.4, 300.0).expect("valid");
    let ball = world.insert(SoftBodyBuilder::new(half_ball, ball).at(2.0, 0.0, 0.0)).expect("a ball");
    let whole = Shape::cuboid(Vec3::repeat(0.2));
    let mut refused = |soft, region: &Shape, to: BodyId, words: &str| {
        let message = world.attach(soft, region, to).expect_err("refused").to_string();
        assert!(message.contains(words), "{message}");
    };
    refused(soft, &whole, soft.into(), "beam cannot be attached to itself");
    refused(soft, &whole, other.into(), "beam cannot be attached to other, which is soft");
    refused(soft, &whole, RigidId::new(0).into(), "Rigid(RigidId(0)): this world has no such body");
    refused(soft, &whole, KinematicId::new(3).into(), "this world has no such body");
    let beside = whole.clone().translated(Vec3::x());
    refused(soft, &beside, BodyId::World, "between [-0.05, -0.01, -0.01] and [0.05, 0.01, 0.01] m");
    let thin = Shape::cuboid(Vec3::new(1e-3, 0.1, 0.1)).translated(Vec3::x() * 0.02);
    refused(soft, &thin, BodyId::World, "holds no node of beam; its voxels are 20.0 mm wide");
    let missing_half = whole.clone().translated(Vec3::x() * 0.104);
    refused(ball, &missing_half, BodyId::World, "the region lies outside of soft body");
    assert!(world.attachments.is_empty());
    world.attach(soft, &whole, BodyId::World).expect("all of it");
}
