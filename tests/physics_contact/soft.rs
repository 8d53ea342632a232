//! Soft against soft, and soft against thin walls and slopes.

use softvt::{
    geometry::{Pose, Vec3, shape::Shape, voxel::Embedding},
    physics::{BodyId, SoftId, World, fem::FemState},
};

use crate::scene::*;

const FRICTION: (f64, f64) = (0.6, 0.5);

fn bread() -> softvt::physics::contact::Friction {
    friction(FRICTION.0, FRICTION.1)
}

/// Squeezes what is between x = −length/2 and length/2 by `squeeze` (m) between two plates; their force, N.
fn squeeze(world: &mut World, length: f64, squeeze: f64) -> f64 {
    let plate = cuboid(0.02, 0.1, 0.1);
    let plates = [-1.0, 1.0].map(|side| {
        let k = world.add_kinematic(at(side * (0.5 * length + 0.01), 0.0, 0.0));
        (k, world.add_shape("plate", k, Pose::identity(), &plate, bread()), side)
    });
    for step in 0..60 {
        let share = (f64::from(step + 1) / 30.0).min(1.0);
        for (k, _, side) in plates {
            world.move_kinematic(k, at(side * (0.5 * length + 0.01 - 0.5 * squeeze * share), 0.0, 0.0));
        }
        world.step().expect("a step that converges");
    }
    let last = SoftId::new(world.soft_bodies().len() - 1);
    let left = world.contact(SoftId::new(0), plates[0].1).force_w.x;
    let right = world.contact(last, plates[1].1).force_w.x;
    assert!((left + right).abs() < 1e-3 * left, "unbalanced: {left} {right} N");
    left
}

#[test]
fn two_cubes_face_to_face_are_as_stiff_as_one_of_double_length() {
    let (cube, bar) = (cuboid(0.05, 0.05, 0.05), cuboid(0.1, 0.05, 0.05));
    let (rest, long) = (fem_model(&cube, crumb(), 6, 2e-3), fem_model(&bar, crumb(), 12, 2e-3));
    let free = || World::new(world().params, Vec3::zeros());
    let mut one = free();
    soft(&mut one, &bar, &long, Pose::identity(), bread());
    let mut two = free();
    let left = soft(&mut two, &cube, &rest, at(-0.025, 0.0, 0.0), bread());
    let right = soft(&mut two, &cube, &rest, at(0.025, 0.0, 0.0), bread());
    let (alone, pair) = (squeeze(&mut one, 0.1, 0.01), squeeze(&mut two, 0.1, 0.01));
    assert!((pair / alone - 1.0).abs() < 0.03, "{pair} N for two, {alone} N for one");
    // The forces on both are equal and opposite, and equal to those of the plates.
    let (on_left, on_right) = (two.contact(left, right).force_w, two.contact(right, left).force_w);
    assert!(
        (on_left + on_right).norm() < 1e-9 && (on_right.x / pair - 1.0).abs() < 0.01,
        "{on_left} {on_right}"
    );
}

#[test]
fn a_soft_collision_keeps_momentum() {
    let mut world = World::new(world().params, Vec3::zeros());
    let cube = cuboid(0.05, 0.05, 0.05);
    let rest = fem_model(&cube, crumb(), 4, 3e-3);
    let a = soft(&mut world, &cube, &rest, at(-0.03, 0.0, 0.0), bread());
    let b =
        soft(&mut world, &cube, &rest, turned(at(0.035, 0.012, 0.006), Vec3::new(0.2, 0.4, 0.3)), bread());
    world.set_soft_motion(a, |_, v| *v = Vec3::new(1.0, 0.1, 0.0));
    let sums = |world: &World| {
        let mut sums = (Vec3::zeros(), Vec3::zeros());
        for body in [a, b].map(|i| &world.soft(i).state) {
            for ((x, v), m) in body.x.iter().zip(&body.v).zip(&body.model.mass) {
                sums = (sums.0 + v * *m, sums.1 + x.cross(v) * *m);
            }
        }
        sums
    };
    let ((linear, angular), energy) = (sums(&world), world.energy().total());
    run(&mut world, 0.4);
    let (linear_now, angular_now) = sums(&world);
    let lever = 0.05 * linear.norm();
    assert!((linear_now - linear).norm() < 1e-5 * linear.norm(), "{linear_now} {linear}");
    assert!((angular_now - angular).norm() < 0.01 * lever, "{angular_now} {angular}");
    assert!(world.energy().total() < 0.95 * energy && world.soft(b).state.velocity().x > 0.3, "they met");
}

#[test]
fn a_soft_block_sticks_below_the_static_angle_and_slides_above_it_with_dynamic_friction() {
    let (mu_s, mu_d) = (0.6f64, 0.4f64);
    let shape = cuboid(0.06, 0.06, 0.02);
    let rest = fem_model(&shape, crumb(), 3, 3e-3);
    let scene = |angle: f64| {
        let mut world = world();
        floor(&mut world, friction(mu_s, mu_d));
        soft(&mut world, &shape, &rest, at(0.0, 0.0, 0.01), friction(0.0, 0.0));
        tilt(&mut world, angle, 0.5);
        world
    };
    let mut held = scene(mu_s.atan() - 0.03);
    let before = held.soft_bodies()[0].state.centre();
    run(&mut held, 3.0);
    let crept = (held.soft_bodies()[0].state.centre() - before).norm();
    assert!(crept < 1e-5, "crept {crept} m in 3 s");
    let angle = mu_s.atan() + 0.05;
    let mut sliding = scene(angle);
    let v0 = sliding.soft_bodies()[0].state.velocity().x;
    run(&mut sliding, 0.3);
    let found = (sliding.soft_bodies()[0].state.velocity().x - v0) / 0.3;
    let expected = GRAVITY * (angle.sin() - mu_d * angle.cos());
    assert!((found / expected - 1.0).abs() < 0.02, "{found} instead of {expected}");
}

#[test]
fn two_stacked_soft_blocks_fall_asleep_and_a_third_wakes_them() {
    let mut world = world();
    world.params.sleeping = true;
    floor(&mut world, bread());
    let shape = cuboid(0.05, 0.05, 0.025);
    let rest = fem_model(&shape, crumb(), 4, 4e-3);
    let low = soft(&mut world, &shape, &rest, at(0.0, 0.0, 0.0125), bread());
    let high = soft(&mut world, &shape, &rest, at(0.004, 0.0, 0.0376), bread());
    run(&mut world, 3.0);
    assert!(world.soft(low).is_asleep() && world.soft(high).is_asleep());
    let asleep_at = world.soft(high).state.centre();
    let third = soft(&mut world, &shape, &rest, at(0.0, 0.0, 0.07), bread());
    run(&mut world, 0.2);
    assert!(!world.soft(high).is_asleep(), "a falling block wakes it");
    run(&mut world, 3.0);
    let (high, third) = (world.soft(high).state.centre(), world.soft(third).state.centre());
    assert!(high.z < asleep_at.z && third.z - high.z > 0.0245, "{high} {third}");
}

#[test]
fn soft_cubes_that_meet_at_two_metres_a_second_do_not_enter_each_other() {
    let mut world = World::new(world().params, Vec3::zeros());
    let cube = cuboid(0.05, 0.05, 0.05);
    let rest = fem_model(&cube, crumb(), 4, 3e-3);
    soft(&mut world, &cube, &rest, at(-0.06, 0.0, 0.0), bread());
    soft(&mut world, &cube, &rest, turned(at(0.06, 0.0, 0.0), Vec3::x() * 0.3), bread());
    for (index, speed) in [(0, 1.0), (1, -1.0)] {
        world.set_soft_motion(SoftId::new(index), |_, v| *v = Vec3::x() * speed);
    }
    let mut nearest = f64::INFINITY;
    for _ in 0..40 {
        world.step().expect("a step that converges");
        // They meet head on, turned about the line between them: all of one stays on one side.
        let front = world.soft_bodies()[0].state.x.iter().map(|x| x.x).fold(f64::NEG_INFINITY, f64::max);
        let back = world.soft_bodies()[1].state.x.iter().map(|x| x.x).fold(f64::INFINITY, f64::min);
        nearest = nearest.min(back - front);
    }
    assert!(nearest < 1e-3 && nearest > -2e-3, "{nearest} m apart at the nearest");
}

/// The deepest that any material of a soft body is behind the surface of `shape`, m; sampled four times along an
/// element's edge.
fn depth(body: &FemState, shape: &Shape) -> f64 {
    let mesh = &body.model.mesh;
    let inside = (0..64).map(|i| Vec3::new((i % 4) as f64, (i / 4 % 4) as f64, (i / 16) as f64) / 3.0);
    let points = inside.flat_map(|local| {
        (0..mesh.elements.len()).map(move |e| {
            let weights = Embedding { element: e as u32, local }.weights();
            weights.iter().zip(&mesh.elements[e]).map(|(w, &node)| body.x[node as usize] * *w).sum::<Vec3>()
        })
    });
    points.map(|p| -shape.distance(&p)).fold(f64::NEG_INFINITY, f64::max)
}

/// Drops a soft cube at 2 m/s; how deep it ever was in `shape`, m, how deep it is in the end, and where it is then.
fn drop_into(shape: &Shape, from: Pose) -> (f64, f64, Vec3) {
    let mut world = world();
    floor(&mut world, bread());
    world.add_shape("vessel", BodyId::World, Pose::identity(), shape, bread());
    let cube = cuboid(0.05, 0.05, 0.05);
    let rest = fem_model(&cube, crumb(), 6, 1.5e-3);
    soft(&mut world, &cube, &rest, from, bread());
    world.set_soft_motion(SoftId::new(0), |_, v| *v = Vec3::z() * -2.0);
    let mut deepest = 0.0f64;
    for step in 0..45 {
        world.step().expect("a step that converges");
        if step % 3 == 2 {
            deepest = deepest.max(depth(&world.soft_bodies()[0].state, shape));
        }
    }
    (deepest, depth(&world.soft_bodies()[0].state, shape), world.soft_bodies()[0].state.centre())
}

#[test]
fn a_soft_cube_dropped_at_two_metres_a_second_crosses_no_wall() {
    let bowl = Shape::lathe(vec![
        [0.0, 0.0],
        [0.03, 0.0],
        [0.07, 0.05],
        [0.066, 0.05],
        [0.028, 0.004],
        [0.0, 0.004],
    ])
    .expect("a bowl");
    let plate = Shape::Cylinder { radius: 0.1, half_height: 0.002 }.translated(Vec3::z() * 0.002);
    let wall = |x: f64, y: f64, along: bool| {
        let size = if along { Vec3::new(0.124, 0.004, 0.06) } else { Vec3::new(0.004, 0.12, 0.06) };
        Shape::cuboid(size).translated(Vec3::new(x, y, 0.03))
    };
    let base = Shape::cuboid(Vec3::new(0.12, 0.12, 0.004)).translated(Vec3::z() * 0.002);
    let basket = Shape::Union(vec![
        base,
        wall(0.062, 0.0, false),
        wall(-0.062, 0.0, false),
        wall(0.0, 0.062, true),
        wall(0.0, -0.062, true),
    ]);
    let askew = turned(at(0.0, 0.0, 0.14), Vec3::new(0.1, 0.15, 0.2));
    let onto_rim = turned(at(0.045, 0.0, 0.14), Vec3::new(0.1, 0.15, 0.2));
    for (name, shape) in [("bowl", &bowl), ("plate", &plate), ("basket", &basket)] {
        for (place, pose) in [("middle", askew), ("rim", onto_rim)] {
            let (deepest, last, centre) = drop_into(shape, pose);
            // The cube's corners reach half a sample's spacing, 0.75 mm, beyond its last samples, and its surface
            // yields by less than its layer, a seventh of a voxel, 1.2 mm.
            assert!(deepest < 1.3e-3, "{name}, {place}: {deepest} m deep, {last} in the end, at {centre}");
            assert!(centre.z > 0.02 && centre.xy().norm() < 0.06, "{name}, {place}: ends at {centre}");
        }
    }
}
