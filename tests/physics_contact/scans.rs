//! Rigid meshes of many small facets, as scans are, come to rest.

use softvt::geometry::{Vec3, mesh::Mesh, shape::Shape};

use crate::scene::*;

/// A solid bounded by `n` × `n` squares of two facets on every face of the cube −1..1, at the places that `map` gives
/// to their corners, m.
fn meshed(n: usize, map: impl Fn(Vec3) -> Vec3) -> Shape {
    let line = |k: usize| 2.0 * k as f64 / n as f64 - 1.0;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for face in 0..6 {
        let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let corner = |[di, dj]: [usize; 2]| {
                let mut p = Vec3::repeat(sign);
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (line(i + di), sign * line(j + dj));
                map(p)
            };
            let first = vertices.len() as u32;
            vertices.extend([[0, 0], [1, 0], [1, 1], [0, 1]].map(corner));
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    Shape::from_mesh(Mesh { vertices, triangles, uvs: Vec::new() }).expect("a closed mesh")
}

/// A value of −1..1 that looks random.
fn noise(p: Vec3) -> f64 {
    2.0 * (p.dot(&Vec3::new(127.1, 311.7, 74.7)).sin() * 43_758.545_3).rem_euclid(1.0) - 1.0
}

/// A cube of 50 mm whose bottom is rough by `height`, m.
fn rough(n: usize, height: f64) -> Shape {
    meshed(n, |p| p * 0.025 + Vec3::z() * if p.z == -1.0 { height * noise(p) } else { 0.0 })
}

/// An ellipsoid with bumps of `height`, m.
fn bumpy(n: usize, radii: Vec3, height: f64) -> Shape {
    meshed(n, |p| {
        let d = p.normalize();
        let bumps = (7.0 * d.x + 1.0).sin() * (8.0 * d.y - 0.5).sin() * (9.0 * d.z).cos();
        d.component_mul(&radii) + d * (height * bumps)
    })
}

/// Time until the body last moves faster than 1 mm/s, s, and whether it sleeps after 3 s.
fn rest(shape: &Shape, hz: f64, mass: f64, height: f64) -> (f64, bool) {
    let mut world = world();
    (world.params.dt, world.params.sleeping) = (1.0 / hz, true);
    floor(&mut world, friction(0.6, 0.5));
    let low = shape.bounds().min.z;
    let body = rigid(&mut world, shape, mass, at(0.0, 0.0, height - low), friction(0.6, 0.5));
    let (radius, mut rest) = (0.5 * shape.bounds().size().norm(), 0.0);
    for step in 1..=(3.0 * hz) as usize {
        run(&mut world, 1.0 / hz);
        let state = &world.rigid(body).state;
        if state.v.norm() + state.w.norm() * radius > 1e-3 {
            rest = step as f64 / hz;
        }
    }
    (rest, world.is_asleep(body))
}

#[test]
fn scans_rest_within_a_second() {
    let flat = Vec3::new(0.04, 0.03, 0.015);
    let bodies = [
        ("rough cube of 10 × 10", rough(10, 5e-4)),
        ("rough cube of 12 × 12", rough(12, 1e-4)),
        ("rough cube of 40 × 40", rough(40, 5e-5)),
        ("pebble", bumpy(16, flat, 0.0)),
        ("bumpy pebble", bumpy(24, flat, 8e-4)),
    ];
    for (name, shape) in &bodies {
        for (hz, mass, height) in [(60.0, 0.3, 0.0), (60.0, 0.05, 1e-3), (240.0, 1.0, 1e-3)] {
            let (time, is_asleep) = rest(shape, hz, mass, height);
            assert!(time < 1.0 && is_asleep, "{name} of {mass} kg at {hz} Hz moves for {time} s");
        }
    }
}
