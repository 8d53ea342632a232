use super::*;
use crate::{
    ArticulationId, AttachmentId, BodyId, ColliderId, ContactPartner, KinematicId, RigidId, SoftId,
    contact::Friction,
    fem::ElasticMaterial,
    joints::{JointKind, JointTree, Link},
    world::{FixedBuilder, JointDrive, KinematicBuilder, RigidBodyBuilder, SoftBodyBuilder},
};
use nalgebra::Unit;
use softvt_geometry::{Mat3, Quat, Vec3, shape::Shape};

const DT: f64 = 1.0 / 60.0;
const PARTS: u32 = 4;

/// A link of 0.5 kg that slides along an axis.
fn slider(axis: Unit<Vec3>, friction: f64) -> JointTree {
    let link = Link {
        name: "slider".to_owned(),
        parent: None,
        placement: Pose::identity(),
        kind: JointKind::Prismatic(axis),
        mass: 0.5,
        com: Vec3::zeros(),
        inertia: Mat3::identity() * 1e-4,
        lower: -0.1,
        upper: 0.1,
        velocity_limit: f64::INFINITY,
        effort_limit: 100.0,
        friction,
        damping: 0.0,
    };
    JointTree { links: vec![link], base_w: Pose::identity() }
}

fn empty() -> World {
    let params = PhysicsParams { average_acceleration: true, sleeping: false, ..PhysicsParams::default() };
    World::new(params, crate::STANDARD_GRAVITY)
}

/// A soft cube that is held below, pressed by a plate that slides on it and carries a brick, and pushed by a drive.
struct Press {
    world: World,
}

impl Press {
    const CUBE: SoftId = SoftId::new(0);
    const BRICK: RigidId = RigidId::new(0);
    const PLATE: KinematicId = KinematicId::new(0);
    const DRIVE: ArticulationId = ArticulationId::new(0);
    const HOLD: AttachmentId = AttachmentId::new(0);

    fn new() -> Self {
        let mut world = empty();
        let (cube, gel) = (Shape::cuboid(Vec3::repeat(0.05)), ElasticMaterial::new(3e4, 0.4, 300.0));
        let gel = gel.and_then(|gel| gel.with_loss_factor(0.1)).expect("valid");
        let cube = world.insert(SoftBodyBuilder::new(cube, gel).resolution(4)).expect("a cube");
        let foot = Shape::cuboid(Vec3::new(0.1, 0.1, 0.01)).translated(Vec3::new(0.0, 0.0, -0.025));
        world.attach(cube, &foot, BodyId::World).expect("a foot");
        world.insert(KinematicBuilder::new(Shape::cuboid(Vec3::new(0.2, 0.2, 0.02))).at(0.0, 0.0, 0.035));
        let brick =
            RigidBodyBuilder::new(Shape::cuboid(Vec3::repeat(0.02)), 2e3).friction(Friction::new(0.2, 0.1));
        world.insert(brick.at(0.0, 0.0, 0.055)).expect("a brick");
        let drive = JointDrive { kp: 500.0, kd: 20.0, target: 0.0, target_velocity: 0.0, effort: 50.0 };
        let drive =
            world.add_articulation("piston", slider(Vec3::x_axis(), 0.0), &[0.0], vec![Some(drive)], false);
        let link = crate::LinkId { articulation: drive, index: 0 };
        let head = Pose::translation(-0.036, 0.0, 0.0);
        world.add_shape("head", link, head, &Shape::cuboid(Vec3::repeat(0.02)), Friction::default());
        Self { world }
    }

    /// Takes a step of `dt` in parts, by a share of the way of plate and drive to their places at a time.
    fn step(&mut self, time: f64, share: f64, dt: f64, parts: u32) {
        let (place, target) = (Vec3::new(3.0 * time * time, 0.0, 0.035 - 0.02 * time), 0.2 * time);
        let at = self.world.kinematic(Self::PLATE).pose.translation.vector.lerp(&place, share);
        self.world.move_kinematic(Self::PLATE, Pose::from_parts(at.into(), Quat::identity()));
        let drives = self.world.articulation_mut(Self::DRIVE).drives_mut();
        drives.iter_mut().flatten().for_each(|drive| drive.target += share * (target - drive.target));
        self.world.params.dt = dt;
        self.world.begin_step();
        let taken = if parts == 1 {
            self.world.solve().and_then(|_| self.world.finish_step())
        } else {
            self.world.step_in_parts(parts)
        };
        taken.expect("a step that converges");
    }

    /// Newton steps, forces and speeds of the last step.
    fn report(&self) -> Vec<f64> {
        let (world, plate) = (&self.world, ColliderId::new(0));
        let patch = world.patch(plate);
        let pressed =
            patch.points.iter().map(|point| (point.normal_p * point.pressure + point.shear_p) * point.area);
        let pressed = pressed.sum::<Vec3>();
        let touched = [world.contact(Self::CUBE, plate), world.contact(Self::BRICK, plate)];
        let touched = touched
            .iter()
            .flat_map(|on| [on.normal_force, on.force_w.x, on.friction_capacity, on.slip_speed]);
        let held = world.attachment(Self::HOLD).force_w;
        let newton = f64::from(world.solver_stats().newton_steps);
        let drive = world.articulation(Self::DRIVE).drive_forces()[0];
        std::iter::once(newton).chain(touched).chain([pressed.x, pressed.z, held.x, held.z, drive]).collect()
    }
}

/// The press after a divided step, and after the same parts as steps alone, each of which is visited.
fn divided_and_alone(mut visit: impl FnMut(&Press)) -> [Press; 2] {
    let mut divided = Press::new();
    (1..=6).for_each(|step| divided.step(f64::from(step) * DT, 1.0, DT, 1));
    let (end, mut alone) = (7.0 * DT, Press { world: divided.world.clone() });
    divided.step(end, 1.0, DT, PARTS);
    for part in 0..PARTS {
        alone.step(end, 1.0 / f64::from(PARTS - part), DT / f64::from(PARTS), 1);
        visit(&alone);
    }
    [divided, alone]
}

#[test]
fn frames_and_the_targets_of_drives_move_along_lines_in_a_divided_step() {
    let [divided, alone] = divided_and_alone(|_| {}).map(|press| press.world);
    let [found, expected] = [&divided, &alone].map(|world| world.articulation(Press::DRIVE).state.q[0]);
    assert!((found - expected).abs() < 1e-9, "drive: {found} m, parts {expected} m");
    let [found, expected] = [&divided, &alone].map(|world| world.soft(Press::CUBE).state.centre());
    assert!((found - expected).norm() < 1e-9, "cube: {found} m, parts {expected} m");
}

#[test]
fn a_divided_step_reports_the_means_of_its_parts() {
    let mut sums = Vec::new();
    let [divided, alone] = divided_and_alone(|part| {
        let found = part.report();
        sums.resize(found.len(), 0.0);
        sums.iter_mut().zip(found).for_each(|(sum, found)| *sum += found);
    });
    // All are means but the number of Newton steps, the first.
    for (index, (found, sum)) in divided.report().into_iter().zip(sums).enumerate() {
        let expected = if index == 0 { sum } else { sum / f64::from(PARTS) };
        let is_near = (found - expected).abs() < 1e-6 * expected.abs();
        assert!(is_near && expected != 0.0, "{index}: {found}, parts {expected}");
    }
    // Distances slipped since first contact add up from part to part.
    let slipped = |press: &Press| press.world.contact(Press::BRICK, ColliderId::new(0)).slip_distance;
    assert!((slipped(&divided) / slipped(&alone) - 1.0).abs() < 1e-6, "{} m", slipped(&divided));
}

#[test]
fn a_part_that_is_solved_and_refused_leaves_nothing_behind() {
    let [straight, refused] = [false, true].map(|is_refused| {
        let mut world = Press::new().world;
        (0..12).for_each(|_| world.step().expect("a step that converges"));
        let place = Pose::translation(0.002, 0.0, 0.0305);
        world.move_kinematic(Press::PLATE, place);
        world.articulation_mut(Press::DRIVE).drives_mut()[0].as_mut().expect("a drive").target = 0.02;
        world.begin_step();
        if is_refused {
            world.solve().expect("a step that converges");
        }
        world.step_in_parts(PARTS).expect("a step that converges");
        assert_eq!(world.kinematic(Press::PLATE).pose, place);
        world
    });
    let [q, other] = [&straight, &refused].map(|world| world.articulation(Press::DRIVE).state.q[0]);
    assert!((q - other).abs() < 1e-12, "drive: {q} m, after a refused part {other} m");
    let [x, other] = [&straight, &refused].map(|world| &world.soft(Press::CUBE).state.x);
    let apart = x.iter().zip(other).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-9, "{apart} m");
    assert_eq!(straight.soft(Press::CUBE).steps_awake, refused.soft(Press::CUBE).steps_awake);
}

#[test]
fn a_large_swing_is_not_damped_by_the_step() {
    let range = |rate: f64| {
        let mut world = World::new(
            PhysicsParams { dt: 1.0 / rate, rayleigh_stiffness: 0.0, ..PhysicsParams::default() },
            crate::STANDARD_GRAVITY,
        );
        let rubber = ElasticMaterial::new(3e5, 0.4, 1000.0).expect("valid");
        let beam = Shape::cuboid(Vec3::new(0.1, 0.02, 0.02));
        let beam = world.insert(SoftBodyBuilder::new(beam, rubber).resolution(10)).expect("a beam");
        let end = Shape::cuboid(Vec3::repeat(0.02)).translated(Vec3::x() * -0.06);
        world.attach(beam, &end, BodyId::World).expect("an end");
        world.run(1.5).expect("steps that converge");
        let heights: Vec<f64> = (0..(0.5 * rate) as usize)
            .map(|_| {
                world.step().expect("a step that converges");
                world.soft(beam).state.centre().z
            })
            .collect();
        heights.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            - heights.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let [coarse, fine] = [60.0, 480.0].map(range);
    assert!((coarse / fine - 1.0).abs() < 0.05, "{coarse} m at 60 Hz, {fine} m at 480 Hz");
}

#[test]
fn the_first_part_of_a_step_takes_of_its_candidates_those_of_a_search() {
    let pairs = |world: &World| world.candidates.pairs().collect::<Vec<_>>();
    let mut world = empty();
    world.insert(FixedBuilder::ground());
    let gel = ElasticMaterial::new(3e4, 0.4, 300.0).expect("valid");
    for height in [0.026, 0.078] {
        let ball = SoftBodyBuilder::new(Shape::Sphere { radius: 0.025 }, gel).at(0.0, 0.0, height);
        let ball = world.insert(ball).expect("a ball");
        world.set_soft_motion(ball, |_, v| *v = Vec3::z() * -10.0 * height);
    }
    world.begin_step();
    let mut part = world.clone();
    part.params.dt /= f64::from(PARTS);
    let mut searched = part.clone();
    part.shorten_candidates();
    searched.find_candidates();
    assert_eq!(pairs(&part), pairs(&searched));
    // Some, but not all, of the candidates between the balls and on the ground.
    let counts = |world: &World| {
        let is_soft = |pair: &&(SoftId, ContactPartner)| matches!(pair.1, ContactPartner::Soft(_));
        let (all, soft) = (pairs(world), pairs(world).iter().filter(is_soft).count());
        [soft, all.len() - soft]
    };
    let (few, many) = (counts(&part), counts(&world));
    assert!((0..2).all(|kind| 0 < few[kind] && few[kind] < many[kind]), "{few:?} of {many:?}");
    // Nothing searches again.
    world.candidates = Default::default();
    world.step_in_parts(1).expect("a step that converges");
    assert!(world.rows.is_empty(), "found again");
}

#[test]
fn the_estimate_of_a_normal_impulse_grows_with_the_step() {
    let mut world = Press::new().world;
    (0..30).for_each(|_| world.step().expect("a step that converges"));
    let contacts = world.problem.points.iter().filter(|point| !point.is_bonded);
    let last: f64 = contacts.map(|point| point.normal_impulse).sum();
    world.params.dt = 0.25 * DT;
    world.begin_step();
    world.assemble().expect("a positive definite system");
    let estimate: f64 = world.problem.points.iter().map(|point| point.previous_normal_impulse).sum();
    assert!((estimate / last - 0.25).abs() < 1e-12, "{estimate} N s after {last} N s");
}

#[test]
fn the_friction_of_a_joint_holds_its_load_through_changes_of_the_step() {
    for axis in [Vec3::z_axis(), -Vec3::z_axis()] {
        let mut world = empty();
        let slider = world.add_articulation("slider", slider(axis, 8.0), &[0.0], vec![None], true);
        (0..20).for_each(|_| world.step().expect("a step that converges"));
        let start = world.articulation(slider).state.q[0];
        assert!(start != 0.0, "the spring is stretched by the load");
        for parts in [8, 8, 1, 32, 2, 1, 1] {
            world.begin_step();
            world.step_in_parts(parts).expect("a step that converges");
            let q = world.articulation(slider).state.q[0];
            assert!(
                (q - start).abs() < 1e-6 * start.abs(),
                "{parts} parts: moved by {} of {start} m",
                q - start
            );
        }
    }
}

#[test]
fn a_stop_that_is_pressed_does_not_throw_the_joint_back_in_short_parts() {
    let mut world = empty();
    let slider = world.add_articulation("slider", slider(Vec3::z_axis(), 0.0), &[-0.1], vec![None], true);
    (0..60).for_each(|_| world.step().expect("a step that converges"));
    for parts in [32, 32, 1, 8] {
        world.begin_step();
        world.step_in_parts(parts).expect("a step that converges");
        // Of the 0.16 m/s by which gravity changes the speed of a free joint in a step.
        let speed = world.articulation(slider).state.v[0];
        assert!(speed.abs() < 0.02 * 9.81 * DT, "{parts} parts: {speed} m/s");
    }
}
