//! A ball that is pressed into a pad and dragged until it slides: the contact points of the solver that stick and those
//! that slip, the motion of the markers, and the tactile image.

use std::time::Duration;

use softvt::{
    geometry::{Vec3, shape::Shape},
    media::{
        animation::{self, AnimationError},
        canvas::Canvas,
    },
    robot::{
        PadSurface,
        tactile::{IMAGE_SIZE, TactileSpec},
    },
    sensing::tactile::{GelScratch, MarkerStyle, PadWrench, SkinMesh, TactileContact, TactileSensor},
};

use crate::{gel::Skin, pad::Punch};

/// File of the animation.
pub const IMAGE: &str = "docs/images/partial_slip.png";

/// Radius of the ball (m), its depth (m), friction, and its way in each frame (m).
const BALL: f64 = 0.02;
const DEPTH: f64 = 6e-4;
const FRICTION: f64 = 0.6;
const WAY: f64 = 4e-5;
const FRAMES: usize = 24;
/// Height of the line of text above the pictures, px.
const HEAD: u32 = 24;
const WORDS: [u8; 3] = [40, 44, 50];
const STICKS: [u8; 3] = [38, 98, 166];
const SLIPS: [u8; 3] = [214, 93, 14];

/// The animation as a PNG file.
pub fn png() -> Result<Vec<u8>, AnimationError> {
    let [width, height] = IMAGE_SIZE.map(|n| n as u32);
    let pad = PadSurface::default();
    let sensor = TactileSensor::new(&TactileSpec::default()).expect("default numbers");
    let ball = Shape::Sphere { radius: BALL }.translated(Vec3::new(0.0, 0.0, BALL));
    let mut punch = Punch::new(&ball, pad, FRICTION, 60.0);
    punch.move_to([DEPTH, 0.0, 0.0], 1.0);
    let frames: Vec<_> = (0..=FRAMES)
        .map(|k| {
            let way = WAY * k as f64;
            punch.move_to([DEPTH, way, 0.0], 0.25);
            let patch = punch.patch();
            let skin = Skin::graph(|x, y| ((x - way).powi(2) + y * y) / (2.0 * BALL) - DEPTH);
            let skins = [SkinMesh { vertices: &skin.vertices, triangles: &skin.triangles }];
            let wrench = PadWrench::from_patch(&patch);
            let contact = TactileContact { wrench, points: &patch.points, skins: &skins, substrate: None };
            let reading = sensor.read(&contact, &mut GelScratch::default()).expect("a good contact");
            let mut canvas = Canvas::new(3 * width, height + HEAD, [255; 3]);
            let share = wrench.force.x / (FRICTION * wrench.normal());
            let texts = [
                format!("solver: {:.2} mm, shear {:.0} % of friction", 1e3 * way, 100.0 * share),
                "motion of the markers × 2".to_owned(),
                "tactile image".to_owned(),
            ];
            for (column, text) in (0_u32..).zip(&texts) {
                canvas.write(text, (column * width) as f32 + 6.0, 17.0, 13.0, WORDS);
            }
            for point in &patch.points {
                let [x, y] = sensor.gel.view.pad_to_image(&point.p_p).map(|px| px as f32);
                let is_slipping = point.shear_p.norm() > 0.95 * FRICTION * point.pressure;
                let colour = if is_slipping { SLIPS } else { STICKS };
                let edge = 10.0 * (point.pressure / 1.5e5).sqrt().min(1.0) as f32;
                canvas.fill(x - 0.5 * edge, y + HEAD as f32 - 0.5 * edge, edge, edge, colour, 1.0);
            }
            let mut enlarged = reading.markers;
            for (from, to) in enlarged.initial.iter().zip(&mut enlarged.current) {
                *to = [0, 1].map(|axis| from[axis] + 2.0 * (to[axis] - from[axis]));
            }
            let mut arrows = image::RgbImage::from_pixel(width, height, image::Rgb([255; 3]));
            enlarged.draw(&mut arrows, MarkerStyle::BlackArrows);
            canvas.place(&arrows, width, HEAD);
            canvas.place(&reading.with_markers(MarkerStyle::Dots), 2 * width, HEAD);
            canvas.to_image()
        })
        .collect();
    let still = &frames[FRAMES / 2];
    animation::encode(still, &frames, Duration::from_millis(200), Duration::from_secs(2))
}
