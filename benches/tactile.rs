//! Time of the tactile sensor per finger: `cargo bench --bench tactile`. Reports the minimum of many rounds, which is
//! hardly affected by other load on the machine.

use std::{hint::black_box, time::Instant};

use softvt::{
    geometry::Vec3,
    robot::{
        PadSurface,
        tactile::{MarkerModel, TactileSpec},
    },
    sensing::tactile::{
        Gel, GelField, GelScratch, Markers, PadWrench, PolynomialOptics, SkinMesh, TactileContact,
    },
};

const ROUNDS: usize = 300;
/// Distance of the vertices of a skin, m: as in the skins of the standard assets.
const SPACING: f64 = 8e-4;
/// Half the width of the skin over the pad, m.
const HALF_WIDTH: f64 = 0.02;

/// An object pressed into the gel.
struct Case {
    name: &'static str,
    /// Lower side of the object as a function of x and y, m.
    height: fn(f64, f64) -> f64,
    wrench: PadWrench,
}

/// Graph of a function, facing the gel.
struct Skin {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

fn main() {
    let cases = [
        Case {
            name: "ball of 4 mm, 1.5 N",
            height: |x, y| (x * x + y * y) / 8e-3,
            wrench: PadWrench::new(1.5, [0.0; 2], 0.0, [0.0; 2]),
        },
        Case {
            name: "ridges, 4 N, 1 N of shear",
            height: |x, y| 4e-4 * (1.0 - (1800.0 * x + 860.0 * y).cos()) + (x * x + y * y) / 0.08,
            wrench: PadWrench::new(4.0, [-1.0, 0.0], 0.0, [0.0; 2]),
        },
        Case {
            name: "bun, 2 N, shear and twist",
            height: |x, y| (x * x + y * y) / 0.2,
            wrench: PadWrench::new(2.0, [-0.5, 0.3], 2e-3, [0.0; 2]),
        },
    ];
    let gel = Gel::new(&TactileSpec::default(), PadSurface::default()).expect("default numbers");
    let optics = PolynomialOptics::gelsight_mini().expect("shipped optics");
    println!(
        "{:<28} {:>9} {:>9} {:>12} {:>11}   ms per finger",
        "case", "field", "image", "with shadows", "99 markers"
    );
    for case in cases {
        report(&case, &gel, &optics);
    }
}

fn report(case: &Case, gel: &Gel, optics: &PolynomialOptics) {
    let Skin { vertices, triangles } = graph(case.height);
    let skins = [SkinMesh { vertices: &vertices, triangles: &triangles }];
    let contact = TactileContact { wrench: case.wrench, skins: &skins, points: &[], substrate: None };
    let mut scratch = GelScratch::default();
    let field = GelField::solve(gel, &contact, &mut scratch).expect("a good contact").expect("a force");
    let solve = min_ms(|| drop(black_box(GelField::solve(gel, &contact, &mut scratch))));
    let image = min_ms(|| drop(black_box(optics.render(gel, Some(&field), false))));
    let with_shadows = min_ms(|| drop(black_box(optics.render(gel, Some(&field), true))));
    let markers = min_ms(|| {
        black_box(Markers::new(gel, &MarkerModel::Elastic {}, Some(&field)));
    });
    println!("{:<28} {solve:>9.3} {image:>9.3} {with_shadows:>12.3} {markers:>11.4}", case.name);
}

/// Minimum time over the rounds, ms.
fn min_ms(mut of: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        of();
        best = best.min(start.elapsed().as_secs_f64());
    }
    1e3 * best
}

fn graph(height: fn(f64, f64) -> f64) -> Skin {
    let n = (2.0 * HALF_WIDTH / SPACING) as u32;
    let at = |i: u32| -HALF_WIDTH + f64::from(i) * SPACING;
    let grid = (0..=n).flat_map(|j| (0..=n).map(move |i| (at(i), at(j))));
    let vertices = grid.map(|(x, y)| Vec3::new(x, y, height(x, y))).collect();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let squares = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, c, b], [a, d, c]]
    });
    Skin { vertices, triangles: triangles.collect() }
}
