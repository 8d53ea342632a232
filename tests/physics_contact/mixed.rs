//! All kinds of body in one solve.

use nalgebra::Unit;
use softvt::{
    geometry::{Mat3, Pose, Vec3},
    physics::{
        BodyId, ColliderId, LinkId,
        joints::{JointKind, JointTree, Link},
        world::JointDrive,
    },
};

use crate::scene::*;

/// A block that slides along x on rails, without limits.
fn slider() -> JointTree {
    let link = Link {
        name: "slider".into(),
        parent: None,
        placement: Pose::identity(),
        kind: JointKind::Prismatic(Unit::new_normalize(Vec3::x())),
        mass: 0.2,
        com: Vec3::zeros(),
        inertia: Mat3::identity() * 1e-4,
        lower: -1.0,
        upper: 1.0,
        velocity_limit: 10.0,
        effort_limit: 100.0,
        friction: 0.0,
        damping: 0.0,
    };
    JointTree { links: vec![link], base_w: Pose::identity() }
}

#[test]
fn two_soft_a_rigid_and_an_articulated_block_share_one_solve() {
    let mut world = world();
    world.gravity = Vec3::zeros();
    // No step is divided, so that all are equally long.
    world.params.dt = 1.0 / 480.0;
    let mu = friction(0.6, 0.5);
    let shape = cuboid(0.04, 0.04, 0.04);
    let rest = fem_model(&shape, crumb(), 4, 2.5e-3);
    let wall_collider =
        world.add_shape("wall", BodyId::World, at(-0.05, 0.0, 0.0), &cuboid(0.1, 0.2, 0.2), mu);
    let first = soft(&mut world, &shape, &rest, at(0.02, 0.0, 0.0), mu);
    let second = soft(&mut world, &shape, &rest, at(0.06, 0.0, 0.0), mu);
    let block = rigid(&mut world, &shape, 0.3, at(0.1, 0.0, 0.0), mu);
    let drive = JointDrive { kp: 2000.0, kd: 100.0, target: 0.1, target_velocity: 0.0, effort: 3.0 };
    let tree = world.add_articulation("slider", slider(), &[0.1405], vec![Some(drive)], false);
    let link = LinkId { articulation: tree, index: 0 };
    world.add_shape("slider", link, Pose::identity(), &shape, mu);
    // On the way: what the wall, the drive and nothing else do is the change of momentum.
    let mut momentum = 0.0;
    let mut touched = [false; 2];
    for step in 0..1920 {
        world.step().expect("a step that converges");
        let soft: f64 = [first, second]
            .map(|i| world.soft(i).state.velocity().x * world.soft(i).state.model.total_mass())
            .iter()
            .sum();
        let now = soft + world.rigid(block).state.momentum().x + 0.2 * world.articulation(tree).state.v[0];
        let wall = world.contact(first, wall_collider).force_w.x;
        let drive = world.articulation(tree).drive_forces()[0];
        // Velocities are those of the middle of the steps.
        let given = (wall + drive) * world.params.dt * if step == 0 { 0.5 } else { 1.0 };
        assert!((now - momentum - given).abs() < 1e-6, "step {step}: {} is not {given} N s", now - momentum);
        momentum = now;
        touched[0] |= wall > 0.0;
        touched[1] |= world.contact(first, second).normal_force > 0.0;
    }
    // At rest: the drive at its limit goes through the whole chain.
    let chain = [
        world.contact(first, wall_collider).force_w.x,
        world.contact(second, first).force_w.x,
        -world.contact(second, ColliderId::new(1)).force_w.x,
    ];
    assert!(chain.iter().all(|force| (force - 3.0).abs() < 0.01), "{chain:?} N");
    assert!(touched[0] && touched[1]);
    let speed = world.rigid(block).state.v.norm() + world.soft(second).state.max_speed();
    assert!(speed < 1e-4, "{speed} m/s");
}
