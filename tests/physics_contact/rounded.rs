//! Bodies without sharp edges: flat faces between roundings, lines, feet that are part of a rounding.

use softvt::{
    geometry::{Pose, Quat, Vec3, mesh::Mesh, shape::Shape},
    physics::{BodyId, World},
};

use crate::scene::*;

/// Motion of a body on a support in one second.
struct Rest {
    /// Distance by which it has sunk, m, and angle by which it has turned, rad.
    sunk: f64,
    turned: f64,
    /// Speed at the end as settling measures it, m/s.
    speed: f64,
}

fn rest(shape: &Shape, mass: f64, object_w: Pose, support: &dyn Fn(&mut World)) -> Rest {
    let mut world = world();
    support(&mut world);
    let body = rigid(&mut world, shape, mass, object_w, friction(0.6, 0.5));
    run(&mut world, 1.0);
    let body = &world.rigid(body).state;
    let now = body.object_w();
    Rest {
        sunk: (object_w.translation.vector - now.translation.vector).z,
        turned: now.rotation.angle_to(&object_w.rotation),
        speed: body.v.norm() + 0.1 * body.w.norm(),
    }
}

/// Asserts that a body rests in place, as light and as heavy as objects of the benchmark.
fn rests(name: &str, shape: &Shape, object_w: Pose, support: &dyn Fn(&mut World)) {
    rest_with(&[0.01, 1.0], name, shape, object_w, support);
}

/// The same with these masses, kg.
fn rest_with(masses: &[f64], name: &str, shape: &Shape, object_w: Pose, support: &dyn Fn(&mut World)) {
    for &mass in masses {
        let Rest { sunk, turned, speed } = rest(shape, mass, object_w, support);
        println!("{name} {mass} kg: sunk {:.1} µm, turned {turned:.1e}, {speed:.1e} m/s", 1e6 * sunk);
        assert!(sunk.abs() < 5e-5, "{name} of {mass} kg sank by {sunk} m");
        assert!(turned < 5e-3 && speed < 1e-3, "{name} of {mass} kg: turned by {turned}, {speed} m/s");
    }
}

fn flat(world: &mut World) {
    floor(world, friction(0.6, 0.5));
}

fn fixed(world: &mut World, shape: &Shape, pose: Pose) {
    world.add_shape("support", BodyId::World, pose, shape, friction(0.6, 0.5));
}

/// A slab with rounded edges, top at z = 0.
fn slab(world: &mut World) {
    fixed(world, &rounded_box(Vec3::new(0.3, 0.25, 0.04), 0.008), at(0.0, 0.0, -0.02));
}

/// A basket of five boxes, its floor at z = 0.
fn basket(world: &mut World) {
    let wall = |x: f64, y: f64| {
        cuboid(0.01 + 0.3 * y.abs() / 0.15, 0.01 + 0.3 * x.abs() / 0.15, 0.08)
            .translated(Vec3::new(x, y, 0.04))
    };
    let base = cuboid(0.3, 0.3, 0.01).translated(Vec3::new(0.0, 0.0, -0.005));
    let walls = [wall(0.15, 0.0), wall(-0.15, 0.0), wall(0.0, 0.15), wall(0.0, -0.15)];
    fixed(world, &walls.into_iter().fold(base, Shape::union), Pose::identity());
}

fn standing(height: f64) -> Pose {
    turned(at(0.013, 0.02, 0.5 * height), Vec3::z() * 0.3)
}

#[test]
fn boxes_with_rounded_edges_of_any_size_rest_in_place() {
    for size in [0.012, 0.024, 0.048, 0.2] {
        for share in [0.02, 0.1, 0.3, 0.45] {
            let shape = rounded_box(Vec3::repeat(size), share * size);
            rests(&format!("box of {size} m, {share}"), &shape, standing(size), &flat);
        }
    }
}

#[test]
fn a_box_with_rounded_edges_rests_on_one_like_it_and_in_a_basket() {
    for share in [0.1, 0.45] {
        let shape = rounded_box(Vec3::repeat(0.048), share * 0.048);
        rests("box on a slab", &shape, standing(0.048), &slab);
        rests("box in a basket", &shape, standing(0.048), &basket);
    }
}

#[test]
fn the_frame_in_which_a_shape_is_written_does_not_matter() {
    let frame = Pose::from_parts(
        Vec3::new(0.01, 0.0, 0.02).into(),
        Quat::from_scaled_axis(Vec3::new(0.3, -0.5, 0.2)),
    );
    let shape = rounded_box(Vec3::new(0.05, 0.06, 0.048), 0.012);
    rests("box in a turned frame", &shape.placed(frame), standing(0.048) * frame.inverse(), &flat);
}

#[test]
fn cans_lying_and_standing_rings_and_loaves_rest() {
    let can = rounded_can(0.03, 0.1, 0.006);
    rests("standing can", &can, standing(0.1), &flat);
    let lying = turned(at(0.0, 0.0, 0.03), Vec3::x() * std::f64::consts::FRAC_PI_2);
    rests("lying can", &can, lying, &flat);
    rests("lying can on a slab", &can, lying, &slab);
    rests("ring", &Shape::Torus { major: 0.03, minor: 0.01 }, standing(0.02), &flat);
    let dent = Shape::Sphere { radius: 0.05 }.translated(Vec3::new(0.0, 0.0, -0.065));
    let dented = rounded_box(Vec3::new(0.08, 0.06, 0.04), 0.01).smooth_subtract(dent, 0.006);
    // At 1 kg, five times as heavy as water, it rocks by some micrometres for ever.
    rest_with(&[0.01, 0.06], "dented loaf", &dented, standing(0.04), &flat);
    // Its foot is an arc of corners, none of them sharp, around a hollow.
    let arc = (0..=24).map(|k| -2.0 + 0.14 * f64::from(k));
    let side = arc.map(|a: f64| [0.028 + 0.009 * a.cos(), 0.009 + 0.009 * a.sin()]);
    let profile = [[0.0, 0.004], [0.02, 0.0035]].into_iter().chain(side).chain([[0.0, 0.019]]);
    let loaf = Shape::lathe(profile.collect()).expect("a loaf");
    let low = loaf.bounds().min.z;
    rests("turned loaf", &loaf, at(0.0, 0.0, -low), &flat);
}

#[test]
fn a_base_carries_however_flat_it_is() {
    for radius in [0.2, 0.3, 1.0, 10.0, 100.0] {
        let core = cuboid(0.06, 0.06, 0.04).translated(Vec3::z() * 0.01);
        let ball = Shape::Sphere { radius }.translated(Vec3::z() * radius);
        let domed = ball.intersect(core).rounded(0.004);
        rests(&format!("base of {radius} m radius"), &domed, at(0.0, 0.0, 0.004), &flat);
    }
}

/// A box of 48 mm whose edges are rounded by `radius` (m), as a mesh: a grid on every face of a cube, moved
/// out from the core.
fn meshed(radius: f64) -> Shape {
    let (inner, steps) = (0.024 - radius, 8);
    // Along an edge: eight steps of the rounding, the flat, eight steps again.
    let turn = |k: usize| std::f64::consts::FRAC_PI_4 * (k as f64 / steps as f64 - 1.0);
    let line: Vec<(f64, f64)> = (0..=steps)
        .map(|k| (-inner, turn(k).tan()))
        .chain((0..=steps).map(|k| (inner, -turn(steps - k).tan())))
        .collect();
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for face in 0..6 {
        let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
        let (first, n) = (vertices.len() as u32, line.len() as u32);
        for (pu, su) in &line {
            for (pv, sv) in &line {
                let mut core = Vec3::zeros();
                let mut way = Vec3::zeros();
                (core[axis], core[(axis + 1) % 3], core[(axis + 2) % 3]) = (sign * inner, *pu, sign * pv);
                (way[axis], way[(axis + 1) % 3], way[(axis + 2) % 3]) = (sign, *su, sign * sv);
                // To a nanometre, as a file has them, so that faces share their corners.
                vertices.push((core + way.normalize() * radius).map(|x| (x * 1e9).round() * 1e-9));
            }
        }
        for (i, j) in (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| (i, j))) {
            let [a, b, c, d] =
                [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|[i, j]| first + i * n + j);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Shape::from_mesh(Mesh { vertices, triangles, uvs: Vec::new() }).expect("a closed mesh")
}

#[test]
fn a_mesh_of_a_box_with_rounded_edges_rests_as_the_box_does() {
    for radius in [0.005, 0.015] {
        rests("mesh", &meshed(radius), standing(0.048), &flat);
    }
}

#[test]
fn an_egg_rolls_from_rest_on_half_a_degree_as_a_ball_does() {
    // Across its axis of symmetry it is a ball: v̇ = 5/7 g sin θ.
    let slope = 0.5f64.to_radians();
    let mut world = tilted(slope);
    flat(&mut world);
    let egg = Shape::Ellipsoid { radii: Vec3::new(0.02, 0.03, 0.02) };
    let body = rigid(&mut world, &egg, 0.1, at(0.0, 0.0, 0.02), friction(0.6, 0.5));
    run(&mut world, 0.2);
    let before = world.rigid(body).state.v.x;
    run(&mut world, 0.3);
    let ratio = (world.rigid(body).state.v.x - before) / 0.3 / (5.0 / 7.0 * GRAVITY * slope.sin());
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}

#[test]
fn a_box_with_rounded_edges_sticks_below_its_angle_and_slides_above_it() {
    let shape = rounded_box(Vec3::new(0.1, 0.1, 0.02), 0.006);
    let on_slope = |angle: f64| {
        let mut world = world();
        floor(&mut world, friction(0.6, 0.4));
        let body = rigid(&mut world, &shape, 0.3, at(0.0, 0.0, 0.01), friction(0.0, 0.0));
        tilt(&mut world, angle, 0.5);
        (world, body)
    };
    let (mut held, body) = on_slope(0.6f64.atan() - 0.02);
    let before = held.rigid(body).state.pose_w.translation.vector;
    run(&mut held, 2.0);
    let crept = (held.rigid(body).state.pose_w.translation.vector - before).norm();
    assert!(crept < 1e-6, "crept {crept} m");
    let angle = 0.6f64.atan() + 0.02;
    let (mut slides, body) = on_slope(angle);
    run(&mut slides, 0.2);
    let before = slides.rigid(body).state.v.x;
    run(&mut slides, 0.3);
    let found = (slides.rigid(body).state.v.x - before) / 0.3;
    let expected = GRAVITY * (angle.sin() - 0.4 * angle.cos());
    assert!((found / expected - 1.0).abs() < 0.01, "{found} instead of {expected}");
}

#[test]
fn two_flat_fingers_lift_a_box_with_rounded_edges_without_slip() {
    for share in [0.1, 0.4] {
        let mut world = world();
        flat(&mut world);
        let shape = rounded_box(Vec3::repeat(0.048), share * 0.048);
        let body = rigid(&mut world, &shape, 0.1, at(0.0, 0.0, 0.024), friction(0.6, 0.5));
        let finger = cuboid(0.01, 0.02, 0.02);
        let place = |side: f64, squeeze: f64, z: f64| at(side * (0.029 - squeeze), 0.0, z);
        let fingers = [-1.0, 1.0].map(|side| (side, world.add_kinematic(place(side, 0.0, 0.024))));
        for (_, id) in fingers {
            world.add_shape("finger", id, Pose::identity(), &finger, friction(0.6, 0.5));
        }
        run(&mut world, 0.2);
        let mut lifted = 0.0;
        for step in 0..180 {
            // Squeezed by 5 µm a side: some newtons.
            let squeeze = 5e-6 * f64::min(1.0, f64::from(step) / 20.0);
            lifted += if (30..120).contains(&step) { 5e-4 } else { 0.0 };
            for (side, id) in fingers {
                world.move_kinematic(id, place(side, squeeze, 0.024 + lifted));
            }
            world.step().expect("a step that converges");
        }
        let now = world.rigid(body).state.object_w();
        let slid = (now.translation.vector - Vec3::z() * (0.024 + lifted)).norm();
        let turned = now.rotation.angle();
        assert!(slid < 5e-5 && turned < 2e-3, "{share}: slid {slid} m, turned {turned}");
    }
}
