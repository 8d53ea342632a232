//! Rigid against rigid; what has a closed form is in `tests/validation/rigid.rs`.

use std::f64::consts::FRAC_PI_2;

use softvt::{
    geometry::{Pose, Vec3, shape::Shape},
    physics::{BodyId, RigidId, World},
};

use crate::scene::*;

fn position(world: &World, body: RigidId) -> Vec3 {
    world.rigid(body).state.pose_w.translation.vector
}

#[test]
fn a_thousandfold_mass_rests_on_a_light_box() {
    let mut world = world();
    floor(&mut world, friction(0.6, 0.5));
    let shape = cuboid(0.05, 0.05, 0.05);
    let light = rigid(&mut world, &shape, 0.1, at(0.0, 0.0, 0.025), friction(0.6, 0.5));
    let heavy = rigid(&mut world, &shape, 100.0, at(0.001, 0.0, 0.0752), friction(0.6, 0.5));
    run(&mut world, 3.0);
    let speed = world.rigid_bodies().iter().map(|r| r.state.v.norm() + r.state.w.norm()).fold(0.0, f64::max);
    let sunk = [(light, 0.025), (heavy, 0.075)].map(|(body, z)| z - position(&world, body).z);
    assert!(speed < 1e-4 && sunk[1] < 2.5e-3 && sunk[0] > 0.0, "{speed} m/s, sunk {sunk:?} m");
}

#[test]
fn a_prescribed_pusher_pushes_and_a_box_bigger_than_what_it_rests_on_is_held_by_friction() {
    let mut world = world();
    floor(&mut world, friction(0.6, 0.5));
    let block = cuboid(0.04, 0.04, 0.04);
    let small = rigid(&mut world, &block, 0.2, at(0.0, 0.0, 0.02), friction(0.6, 0.5));
    let tray = rigid(&mut world, &cuboid(0.12, 0.12, 0.01), 0.2, at(0.0, 0.0, 0.045), friction(0.6, 0.5));
    let hand = world.add_kinematic(at(-0.03, 0.0, 0.02));
    world.add_shape("hand", hand, Pose::identity(), &cuboid(0.02, 0.02, 0.02), friction(0.6, 0.5));
    run(&mut world, 0.2);
    let speed = 0.05;
    for step in 0..60 {
        let x = -0.03 + speed * f64::from(step + 1) * world.params.dt;
        world.move_kinematic(hand, at(x, 0.0, 0.02));
        world.step().expect("a step that converges");
    }
    let (small, tray) = (position(&world, small), position(&world, tray));
    assert!((small.x - speed).abs() < 1e-3, "pushed to {small}");
    assert!((tray.x - small.x).abs() < 1e-4, "the tray stays behind: {tray} {small}");
}

#[test]
fn a_lathe_bowl_stands_on_its_foot() {
    let mut world = world();
    floor(&mut world, friction(0.6, 0.5));
    let profile = vec![[0.0, 0.0], [0.03, 0.0], [0.05, 0.03], [0.046, 0.03], [0.028, 0.005], [0.0, 0.005]];
    let bowl = Shape::lathe(profile).expect("a bowl");
    let index = rigid(&mut world, &bowl, 0.2, at(0.0, 0.0, 0.002), friction(0.6, 0.5));
    run(&mut world, 1.0);
    let object = world.rigid(index).state.object_w();
    let tilt = (object.rotation * Vec3::z()).angle(&Vec3::z());
    let z = object.translation.vector.z;
    assert!(z.abs() < 1e-4 && tilt < 1e-3, "z {z} m, tilt {tilt} rad");
}

#[test]
fn a_resting_box_falls_asleep_and_a_push_wakes_it() {
    let mut world = world();
    world.params.sleeping = true;
    floor(&mut world, friction(0.6, 0.5));
    let shape = cuboid(0.05, 0.05, 0.05);
    let low = rigid(&mut world, &shape, 0.3, at(0.0, 0.0, 0.025), friction(0.6, 0.5));
    let high = rigid(&mut world, &shape, 0.3, at(0.0, 0.0, 0.076), friction(0.6, 0.5));
    run(&mut world, 2.0);
    assert!(world.rigid(low).is_asleep() && world.rigid(high).is_asleep());
    let ball =
        rigid(&mut world, &Shape::Sphere { radius: 0.02 }, 0.3, at(-0.1, 0.0, 0.075), friction(0.6, 0.5));
    world.rigid_mut(ball).state.v = Vec3::x() * 2.0;
    run(&mut world, 0.1);
    let (upper, lower) = (position(&world, high), position(&world, low));
    assert!(upper.x > 0.005, "pushed: {upper}");
    assert!(lower.x < 0.5 * upper.x && !world.rigid(high).is_asleep(), "{lower}");
}

#[test]
fn a_cone_stays_on_its_side_on_a_thin_shelf() {
    let mut world = world();
    let shelf = cuboid(0.2, 0.2, 0.004);
    world.add_shape("shelf", BodyId::World, Pose::translation(0.0, 0.0, -0.002), &shelf, friction(0.6, 0.5));
    let cone = Shape::lathe(vec![[0.0, -0.01], [0.01, 0.01], [0.0, 0.01]]).expect("a cone");
    // On its side, the axis rises from the tip by half the opening angle.
    let half_angle = 0.5_f64.atan();
    let pose = turned(at(0.0, 0.0, 0.01 * half_angle.sin() + 1e-3), Vec3::y() * (FRAC_PI_2 - half_angle));
    let index = rigid(&mut world, &cone, 0.1, pose, friction(0.6, 0.5));
    world.rigid_mut(index).state.v = Vec3::y() * 0.05;
    for tenth in 0..30 {
        run(&mut world, 0.1);
        let object = world.rigid(index).state.object_w();
        let z = object.translation.vector.z;
        assert!(
            tenth < 5 || (z - 0.01 * half_angle.sin()).abs() < 1e-4,
            "{z} m after {tenth} tenths of a second"
        );
    }
}

#[test]
fn fast_bodies_are_stopped_by_a_thin_shelf() {
    let ball = Shape::Sphere { radius: 0.01 };
    let die = cuboid(0.01, 0.01, 0.01);
    let cone = Shape::lathe(vec![[0.0, -0.01], [0.01, 0.01], [0.0, 0.01]]).expect("a cone");
    for shape in [ball, die, cone] {
        let mut world = world();
        world.add_shape(
            "shelf",
            BodyId::World,
            Pose::identity(),
            &cuboid(0.2, 0.2, 0.004),
            friction(0.6, 0.5),
        );
        let pose = turned(at(0.01, 0.02, 0.1), Vec3::new(0.5, 0.3, 0.0));
        let body = rigid(&mut world, &shape, 0.1, pose, friction(0.6, 0.5));
        world.rigid_mut(body).state.v = Vec3::z() * -5.0;
        run(&mut world, 0.5);
        let z = position(&world, body).z;
        assert!(z > 0.005 && z < 0.03, "{shape:?} ends at {z} m");
    }
}
