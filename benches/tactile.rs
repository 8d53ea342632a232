//! Time of the tactile sensor, a finger: `cargo bench --bench tactile`. The least of many rounds, so that other load on the
//! machine counts little.

use std::{hint::black_box, time::Instant};

use softvt::{
    geometry::Vec3,
    robot::PadSurface,
    sensing::tactile::{
        Gel, MarkerModel, Optics, PadInput, PadLoad, Scratch, Surface, TactileSpec, markers, sense,
    },
};

const ROUNDS: usize = 300;
/// Edge of a skin's cells, m: as fine as the skins of the shipped assets.
const SKIN: f64 = 8e-4;
/// Half the width of the skin over the pad, m.
const HALF: f64 = 0.02;

/// A case: the lower side of what is pressed, and the load.
struct Case {
    name: &'static str,
    height: fn(f64, f64) -> f64,
    load: PadLoad,
}

fn main() {
    let cases = [
        Case {
            name: "ball of 4 mm, 1.5 N",
            height: |x, y| (x * x + y * y) / 8e-3,
            load: PadLoad::new(1.5, [0.0; 2], 0.0, [0.0; 2]),
        },
        Case {
            name: "ridges, 4 N, 1 N of shear",
            height: |x, y| 4e-4 * (1.0 - (1800.0 * x + 860.0 * y).cos()) + (x * x + y * y) / 0.08,
            load: PadLoad::new(4.0, [-1.0, 0.0], 0.0, [0.0; 2]),
        },
        Case {
            name: "bun, 2 N, shear and twist",
            height: |x, y| (x * x + y * y) / 0.2,
            load: PadLoad::new(2.0, [-0.5, 0.3], 2e-3, [0.0; 2]),
        },
    ];
    let gel = Gel::new(&TactileSpec::default(), PadSurface::default()).expect("default numbers");
    let optics = Optics::mini().expect("shipped optics");
    println!(
        "{:<28} {:>9} {:>9} {:>12} {:>11}   ms a finger",
        "case", "field", "picture", "with shadows", "99 markers"
    );
    for case in cases {
        report(&case, &gel, &optics);
    }
}

fn report(case: &Case, gel: &Gel, optics: &Optics) {
    let (vertices, triangles) = skin(case.height);
    let surfaces = [Surface { vertices: &vertices, triangles: &triangles }];
    let input = PadInput { load: case.load, surfaces: &surfaces, friction: 1.5, give: None };
    let mut scratch = Scratch::default();
    let field = sense(gel, &input, &mut scratch).expect("a good touch").expect("a force");
    let mut rgb = vec![0; 320 * 240 * 3];
    let sensing = least(|| drop(black_box(sense(gel, &input, &mut scratch))));
    let picture = least(|| optics.picture(gel, Some(&field), false, &mut rgb));
    let shaded = least(|| optics.picture(gel, Some(&field), true, &mut rgb));
    let moving = least(|| {
        black_box(markers(gel, &MarkerModel::Elastic, Some(&field)));
    });
    println!("{:<28} {sensing:>9.3} {picture:>9.3} {shaded:>12.3} {moving:>11.4}", case.name);
}

/// Least time of the rounds, ms.
fn least(mut of: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        of();
        best = best.min(start.elapsed().as_secs_f64());
    }
    1e3 * best
}

/// The graph of `height`, seen from below.
fn skin(height: fn(f64, f64) -> f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let n = (2.0 * HALF / SKIN) as u32;
    let at = |i: u32| -HALF + f64::from(i) * SKIN;
    let places = (0..=n).flat_map(|j| (0..=n).map(move |i| (at(i), at(j))));
    let vertices = places.map(|(x, y)| Vec3::new(x, y, height(x, y))).collect();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let squares = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, c, b], [a, d, c]]
    });
    (vertices, triangles.collect())
}
