//! Pictures and markers of three imprints, byte for byte as they were when somebody last looked at them.
//!
//! `SOFTVT_WRITE_GOLDEN=1 cargo test --release --lib golden_tests` writes them anew; look at them before they are committed.

use std::path::Path;

use image::{RgbImage, imageops::replace};

use super::{MarkerStyle, PadInput, PadLoad, Scratch, Sensor, Surface, TactileSpec, field_tests::graph};

/// The picture of a touch, and beside it the motion of its markers.
fn seen(height: impl Fn(f64, f64) -> f64, load: PadLoad) -> RgbImage {
    let sensor = Sensor::new(&TactileSpec::default()).expect("default numbers");
    let (vertices, triangles) = graph(16e-3, 2e-4, height);
    let surfaces = [Surface { vertices: &vertices, triangles: &triangles }];
    let input = PadInput { load, surfaces: &surfaces, friction: 1.5, give: None };
    let touched = sensor.see(&input, &mut Scratch::default()).expect("a good touch");
    let mut both = RgbImage::new(640, 240);
    replace(&mut both, &touched.picture, 0, 0);
    replace(&mut both, &touched.with_markers(MarkerStyle::Arrows), 320, 0);
    both
}

fn check(name: &str, found: &RgbImage) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/tactile").join(name);
    if std::env::var_os("SOFTVT_WRITE_GOLDEN").is_some() {
        found.save(&path).expect("a folder that can be written to");
    }
    let golden = image::open(&path).expect("a golden picture").into_rgb8();
    assert_eq!(golden.dimensions(), found.dimensions(), "{name}");
    let differences = || golden.iter().zip(found.iter()).map(|(a, b)| a.abs_diff(*b));
    let count = differences().filter(|&d| d > 0).count();
    assert_eq!(
        count,
        0,
        "{name}: {count} values differ, by up to {} of 255",
        differences().max().unwrap_or(0)
    );
}

#[test]
fn a_ball_looks_as_it_did() {
    let ball = |x: f64, y: f64| ((x - 3e-3).powi(2) + (y + 2e-3).powi(2)) / 8e-3;
    check("ball.png", &seen(ball, PadLoad::new(1.5, [-0.6, 0.0], 0.0, [3e-3, -2e-3])));
}

#[test]
fn an_edge_looks_as_it_did() {
    // The straight edge of a wedge, 100° wide, across the pad at 30°.
    let edge = |x: f64, y: f64| 0.84 * (0.5 * x - 0.866 * y).abs();
    check("edge.png", &seen(edge, PadLoad::new(6.0, [0.0, 1.5], 0.0, [0.0; 2])));
}

#[test]
fn ridges_look_as_they_did() {
    let ridges = |x: f64, y: f64| 3e-4 * (1.0 - (1800.0 * x + 860.0 * y).cos()) + (x * x + y * y) / 0.12;
    check("ridges.png", &seen(ridges, PadLoad::new(8.0, [0.0; 2], 1.5e-2, [0.0; 2])));
}
