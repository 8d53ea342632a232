//! The motion of an 11 × 9 grid of markers.

use super::{
    field::GelField,
    gel::Gel,
    spec::{FotsSpec, MarkerModel},
};
use crate::geometry::Vec3;

/// Number of markers: 9 rows of 11.
pub const MARKERS: usize = 99;
/// Columns of the untouched grid, px.
const X: [f32; 11] = [15.0, 44.0, 73.0, 102.0, 131.0, 160.0, 189.0, 218.0, 247.0, 276.0, 305.0];
/// Rows of the untouched grid, px.
const Y: [f32; 9] = [26.0, 49.0, 73.0, 96.0, 120.0, 143.0, 167.0, 190.0, 214.0];

/// Places of markers, (x, y) px, row by row.
pub type Places = [[f32; 2]; MARKERS];

/// Initial and present places of one finger's markers: the shape (2, 99, 2) of the observation.
pub type Markers = [Places; 2];

/// Where the markers are without a touch.
pub fn untouched() -> Places {
    std::array::from_fn(|m| [X[m % X.len()], Y[m / X.len()]])
}

/// Initial and present places. Without a touch they are the same, to the bit.
pub fn markers(gel: &Gel, model: &MarkerModel, field: Option<&GelField>) -> Markers {
    let initial = untouched();
    let Some(field) = field else { return [initial, initial] };
    let present = match model {
        MarkerModel::Elastic => initial.map(|px| elastic(gel, field, px)),
        MarkerModel::Fots(law) => fots(gel, law, field, &initial),
    };
    [initial, present]
}

/// A marker that moves with the gel's surface, seen through the pinhole: a dent brings the surface nearer to the lens and
/// so moves its markers outwards in the picture, besides what the gel itself does.
fn elastic(gel: &Gel, field: &GelField, px: [f32; 2]) -> [f32; 2] {
    let rest = gel.view.image_to_pad(&gel.pad, px.map(f64::from));
    let moved = gel.view.pad_to_image(&(rest + Vec3::from(field.at(gel, rest.x, rest.y))));
    moved.map(|x| x as f32)
}

/// FOTS's law (Zhao et al., arXiv 2404.19217), all three parts at the untouched places: dilation away from each touched
/// marker by the height of the dent there, shear and twist with the contact's motion, fading from its centre. The twist
/// is (R(θ) − I)(M − G); the released codes take cos(θ − 1) for cos θ − 1.
fn fots(gel: &Gel, law: &FotsSpec, field: &GelField, initial: &Places) -> Places {
    let scale = law.scale * 1e3;
    let to_px = |at: [f64; 2]| [160.0 + scale * at[0], 120.0 + scale * at[1]];
    let to_pad = |px: [f32; 2]| [(f64::from(px[0]) - 160.0) / scale, (f64::from(px[1]) - 120.0) / scale];
    let at = field.centre(gel);
    let centre = to_px(at);
    let (turn, motion) = (field.motion.z, &field.motion);
    let drift = [scale * (motion.x - turn * at[1]), scale * (motion.y + turn * at[0])];
    let dents: Vec<([f64; 2], f64)> = initial
        .iter()
        .filter_map(|&px| {
            let [x, y] = to_pad(px);
            let height = -field.at(gel, x, y)[2] * 1e3 * law.height_factor;
            (field.touches(gel, x, y) && height > 0.0).then(|| (px.map(f64::from), height))
        })
        .collect();
    initial.map(|px| {
        let m = px.map(f64::from);
        let (arm, r2) = away(m, centre);
        let (shear, twist) = ((-law.shear * r2).exp(), (-law.twist * r2).exp());
        let (sin, cos) = turn.sin_cos();
        let mut moved = [
            m[0] + drift[0] * shear + ((cos - 1.0) * arm[0] - sin * arm[1]) * twist,
            m[1] + drift[1] * shear + (sin * arm[0] + (cos - 1.0) * arm[1]) * twist,
        ];
        for &(source, height) in &dents {
            let (arm, r2) = away(m, source);
            let weight = height * (-law.dilate * r2).exp();
            moved = [moved[0] + weight * arm[0], moved[1] + weight * arm[1]];
        }
        moved.map(|x| x as f32)
    })
}

fn away(m: [f64; 2], from: [f64; 2]) -> ([f64; 2], f64) {
    let arm = [m[0] - from[0], m[1] - from[1]];
    (arm, arm[0] * arm[0] + arm[1] * arm[1])
}

/// How markers are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MarkerStyle {
    /// A dark dot at each present place.
    Dots,
    /// An arrow from the initial to the present place, lengthened `ARROW_GAIN` times.
    Arrows,
}

/// Lengthening of drawn arrows: elastic motion is mostly below a few pixels.
pub const ARROW_GAIN: f32 = 3.0;
/// Radius of a dot, px.
const DOT: f32 = 2.6;
/// Half the width of an arrow's line, px.
const LINE: f32 = 0.8;

/// Draws markers into a picture of 320 × 240 RGB.
pub fn draw_markers(rgb: &mut [u8], markers: &Markers, style: MarkerStyle) {
    for (from, to) in markers[0].iter().zip(&markers[1]) {
        match style {
            MarkerStyle::Dots => capsule(rgb, *to, *to, DOT, [20, 20, 24]),
            MarkerStyle::Arrows => {
                let tip = [0, 1].map(|a| from[a] + ARROW_GAIN * (to[a] - from[a]));
                arrow(rgb, *from, tip);
            }
        }
    }
}

fn arrow(rgb: &mut [u8], from: [f32; 2], tip: [f32; 2]) {
    let colour = [255, 230, 40];
    let (dx, dy) = (tip[0] - from[0], tip[1] - from[1]);
    let length = dx.hypot(dy);
    capsule(rgb, from, tip, LINE, colour);
    if length > 1.0 {
        let head = (0.4 * length).min(5.0) / length;
        for side in [-0.6, 0.6] {
            let end = [tip[0] - head * (dx - side * dy), tip[1] - head * (dy + side * dx)];
            capsule(rgb, tip, end, LINE, colour);
        }
    }
}

/// A line with round ends, with smooth edges.
fn capsule(rgb: &mut [u8], a: [f32; 2], b: [f32; 2], radius: f32, colour: [u8; 3]) {
    let [wide, high] = super::spec::PICTURE;
    let reach = radius + 1.0;
    let range = |p: f32, q: f32, end: usize| {
        let low = (p.min(q) - reach).clamp(0.0, end as f32) as usize;
        let high = (p.max(q) + reach + 1.0).clamp(0.0, end as f32) as usize;
        low..high
    };
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let square = dx * dx + dy * dy;
    for j in range(a[1], b[1], high) {
        for i in range(a[0], b[0], wide) {
            let (x, y) = (i as f32 + 0.5 - a[0], j as f32 + 0.5 - a[1]);
            let t = if square > 0.0 { ((x * dx + y * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
            let cover = (radius + 0.5 - (x - t * dx).hypot(y - t * dy)).clamp(0.0, 1.0);
            let Some(pixel) = rgb.get_mut(3 * (j * wide + i)..3 * (j * wide + i) + 3) else { continue };
            for (value, &ink) in pixel.iter_mut().zip(&colour) {
                let old = f32::from(*value);
                *value = (old + cover * (f32::from(ink) - old)).round() as u8;
            }
        }
    }
}
