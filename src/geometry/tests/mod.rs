//! Tests of shapes and meshes against closed forms and the exact mesh distance of parry.

mod foreign_files;
mod import;
mod inputs;
mod meshes;
mod shapes;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    Vec3,
    mesh::Mesh,
    shape::{Axis, Bumps, Ramp, Ridges, Shape, SurfaceRelief},
};

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(7)
}

fn random_unit(rng: &mut ChaCha8Rng) -> Vec3 {
    loop {
        let v = Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        if (0.1..1.0).contains(&v.norm()) {
            return v.normalize();
        }
    }
}

fn ridges(axis: Axis, height: f64, count: i32, pitch: f64) -> SurfaceRelief {
    SurfaceRelief::Ridges(Ridges {
        axis,
        height,
        count,
        pitch,
        radial_pitch: f64::INFINITY,
        phase: 0.3,
        sharpness: 1.0,
        mask: Some(Ramp { axis: Axis::Z, from: -0.01, to: 0.01 }),
    })
}

fn seeds() -> SurfaceRelief {
    SurfaceRelief::Bumps(Bumps { height: 0.5e-3, radius: 3e-3, spacing: 8e-3, seed: 3, mask: None })
}

/// Primitives, and placements and materials of them, which have exact distances.
fn exact_shapes() -> Vec<(&'static str, Shape)> {
    let plate = vec![[0.0, 0.0], [0.05, 0.0], [0.08, 0.015], [0.078, 0.019], [0.049, 0.006], [0.0, 0.006]];
    let ball = Shape::Sphere { radius: 0.02 };
    let turn = super::Quat::from_euler_angles(0.4, -0.7, 1.1);
    vec![
        ("box", Shape::cuboid(Vec3::new(0.056, 0.04, 0.03))),
        ("sphere", Shape::Sphere { radius: 0.0285 }),
        ("capsule", Shape::Capsule { radius: 0.022, half_length: 0.017 }),
        ("cylinder", Shape::Cylinder { radius: 0.0265, half_height: 0.03 }),
        ("torus", Shape::Torus { major: 0.03, minor: 0.012 }),
        ("wedge", wedge()),
        ("plate", lathe(plate)),
        (
            "turned box",
            Shape::cuboid(Vec3::new(0.05, 0.04, 0.03)).rotated(turn).translated(Vec3::new(0.01, 0.0, 0.02)),
        ),
        ("rounded box", Shape::cuboid(Vec3::new(0.04, 0.03, 0.02)).rounded(0.006)),
        ("scaled sphere", ball.clone().scaled(Vec3::repeat(1.5))),
        ("painted sphere", ball.painted(2, None)),
    ]
}

/// Combinations and warps with sizes and curvatures of pastries.
fn composite_shapes() -> Vec<(&'static str, Shape)> {
    let ball = Shape::Sphere { radius: 0.02 };
    let brick = Shape::cuboid(Vec3::new(0.05, 0.04, 0.03));
    let loaf = Shape::Ellipsoid { radii: Vec3::new(0.042, 0.03, 0.022) };
    let bar = Shape::cuboid(Vec3::new(0.08, 0.018, 0.016)).rounded(0.006);
    let beside = |shape: &Shape, x: f64| shape.clone().translated(Vec3::new(x, 0.0, 0.0));
    vec![
        ("ellipsoid", loaf.clone()),
        (
            "stretched capsule",
            Shape::Capsule { radius: 0.02, half_length: 0.02 }.scaled(Vec3::new(1.2, 0.9, 1.1)),
        ),
        ("shell", Shape::Sphere { radius: 0.04 }.shell(0.012)),
        ("union", ball.clone().union(beside(&ball, 0.025))),
        ("intersection", brick.clone().intersect(Shape::Cylinder { radius: 0.022, half_height: 0.1 })),
        ("box less box", brick.clone().subtract(Shape::cuboid(Vec3::new(0.03, 0.02, 0.04)))),
        ("smooth union", beside(&ball, -0.013).smooth_union(beside(&ball, 0.013), 0.012)),
        ("smooth subtraction", Shape::Sphere { radius: 0.03 }.smooth_subtract(beside(&ball, 0.035), 0.008)),
        ("twisted bar", bar.clone().twisted(Axis::X, 15.0)),
        ("bent bar", bar.bent(Axis::X, Axis::Y, 12.0)),
        ("ridged loaf", loaf.clone().displaced(ridges(Axis::X, 0.8e-3, 0, 0.016))),
        ("fluted loaf", loaf.clone().displaced(ridges(Axis::Z, 1e-3, 8, f64::INFINITY))),
        ("seeded loaf", loaf.displaced(seeds())),
    ]
}

/// Nested combinations: a crate with rounded corners, cut-down long sides, and a hole in each end.
fn crate_with_low_sides() -> Shape {
    let upright = |x, y, z| {
        let sides = Shape::cuboid(Vec3::new(x - 0.02, y - 0.02, 0.2)).rounded(0.01);
        sides.intersect(Shape::cuboid(Vec3::new(0.3, 0.3, z)))
    };
    let inside = upright(0.108, 0.088, 0.08).translated(Vec3::z() * 0.008);
    let dip = Shape::cuboid(Vec3::new(0.06, 0.2, 0.06)).translated(Vec3::z() * 0.045);
    let holes = Shape::cuboid(Vec3::new(0.2, 0.02, 0.004)).rounded(0.006).translated(Vec3::z() * 0.02);
    upright(0.12, 0.1, 0.08).subtract(inside).subtract(dip).subtract(holes)
}

fn wedge() -> Shape {
    Shape::wedge(Vec3::new(0.064, 0.05, 0.04), -0.4).expect("a triangle")
}

fn lathe(corners: Vec<[f64; 2]>) -> Shape {
    Shape::lathe(corners).expect("a simple polygon")
}

/// V − E + F, which is 2 − 2g for a closed surface of genus g.
fn euler(mesh: &Mesh) -> i64 {
    let edges: std::collections::BTreeSet<[u32; 2]> = mesh
        .triangles
        .iter()
        .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(a, b)| [a.min(b), a.max(b)]))
        .collect();
    mesh.vertices.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64
}
