//! Images and markers of three imprints, byte for byte as in `tests/golden/tactile`.
//!
//! `.ci/regenerate golden-images` writes them again; look at them before they are committed.

use std::path::Path;

use image::{RgbImage, imageops::replace};

use super::{GelScratch, MarkerStyle, PadWrench, TactileContact, TactileSensor, elastic::tests::graph};
use softvt_robot::tactile::TactileSpec;

/// Image of a contact, and next to it the motion of its markers.
fn imprint(height: impl Fn(f64, f64) -> f64, wrench: PadWrench) -> RgbImage {
    let sensor = TactileSensor::new(&TactileSpec::default()).expect("default numbers");
    let skin = graph(16e-3, 2e-4, height);
    let contact = TactileContact { wrench, skins: &[skin.mesh()], points: &[], substrate: None };
    let reading = sensor.read(&contact, &mut GelScratch::default()).expect("a good contact");
    let mut both = RgbImage::new(640, 240);
    replace(&mut both, &reading.image, 0, 0);
    replace(&mut both, &reading.with_markers(MarkerStyle::Arrows), 320, 0);
    both
}

fn check(name: &str, found: &RgbImage) {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/golden/tactile").join(name);
    if std::env::var_os("SOFTVT_WRITE_GOLDEN").is_some() {
        found.save(&path).expect("a folder that can be written to");
    }
    let golden = image::open(&path).expect("a golden image").into_rgb8();
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
fn the_imprint_of_a_ball_is_golden() {
    let ball = |x: f64, y: f64| ((x - 3e-3).powi(2) + (y + 2e-3).powi(2)) / 8e-3;
    check("ball.png", &imprint(ball, PadWrench::new(1.5, [-0.6, 0.0], 0.0, [3e-3, -2e-3])));
}

#[test]
fn the_imprint_of_an_edge_is_golden() {
    // The straight edge of a wedge, 100° wide, across the pad at 30°.
    let edge = |x: f64, y: f64| 0.84 * (0.5 * x - 0.866 * y).abs();
    check("edge.png", &imprint(edge, PadWrench::new(6.0, [0.0, 1.5], 0.0, [0.0; 2])));
}

#[test]
fn the_imprint_of_ridges_is_golden() {
    let ridges = |x: f64, y: f64| 3e-4 * (1.0 - (1800.0 * x + 860.0 * y).cos()) + (x * x + y * y) / 0.12;
    check("ridges.png", &imprint(ridges, PadWrench::new(8.0, [0.0; 2], 1.5e-2, [0.0; 2])));
}
