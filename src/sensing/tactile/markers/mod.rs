//! Printed markers of the gel, a grid of 11 × 9: their positions in the image, drawings, and measures of their motion.

mod flow;
#[cfg(test)]
mod tests;

use nalgebra::Vector2;

pub use self::flow::MarkerFlow;
use super::elastic::{Gel, GelField};
use softvt_geometry::Vec3;
use softvt_robot::tactile::{FotsSpec, IMAGE_SIZE, MarkerModel};

/// Number of markers: 9 rows of 11.
pub const MARKER_COUNT: usize = 99;
/// x of the columns of the grid without a contact, px.
const COLUMNS: [f32; 11] = [15.0, 44.0, 73.0, 102.0, 131.0, 160.0, 189.0, 218.0, 247.0, 276.0, 305.0];
/// y of the rows of the grid without a contact, px.
const ROWS: [f32; 9] = [26.0, 49.0, 73.0, 96.0, 120.0, 143.0, 167.0, 190.0, 214.0];

/// Positions (x, y) of all markers in the image, px, row by row.
pub type MarkerPositions = [[f32; 2]; MARKER_COUNT];

/// Markers of one finger: positions without a contact and now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Markers {
    /// Positions without a contact.
    pub initial: MarkerPositions,
    /// Positions under the current contact.
    pub current: MarkerPositions,
}

impl Markers {
    /// Markers of a gel without a contact.
    pub fn at_rest() -> Self {
        let initial = std::array::from_fn(|m| [COLUMNS[m % COLUMNS.len()], ROWS[m / COLUMNS.len()]]);
        Self { initial, current: initial }
    }

    /// Markers of a gel under a field. Without a field, current and initial positions are identical.
    pub fn new(gel: &Gel, model: &MarkerModel, field: Option<&GelField>) -> Self {
        let rest = Self::at_rest();
        let Some(field) = field else { return rest };
        let current = match model {
            MarkerModel::Elastic {} => rest.initial.map(|px| elastic(gel, field, px)),
            MarkerModel::Fots(law) => fots(gel, law, field, &rest.initial),
        };
        Self { current, ..rest }
    }

    /// Initial and current positions: the shape (2, 99, 2) of the observation.
    pub fn to_array(&self) -> [MarkerPositions; 2] {
        [self.initial, self.current]
    }

    /// Draws the markers into an image of 320 × 240 RGB.
    pub fn draw(&self, rgb: &mut [u8], style: MarkerStyle) {
        for (from, to) in self.initial.iter().zip(&self.current) {
            match style {
                MarkerStyle::Dots => capsule(rgb, *to, *to, DOT_RADIUS, [20, 20, 24]),
                MarkerStyle::Arrows => ArrowStyle::YELLOW.draw(rgb, *from, *to),
                MarkerStyle::BlackArrows => ArrowStyle::BLACK.draw(rgb, *from, *to),
            }
        }
    }
}

/// Position of a marker that moves with the surface of the gel, seen through the pinhole. A dent brings the surface
/// closer to the pinhole, which moves its markers outwards in addition to their displacement along the surface.
fn elastic(gel: &Gel, field: &GelField, px: [f32; 2]) -> [f32; 2] {
    let rest = gel.view.image_to_pad(&gel.pad, px.map(f64::from));
    let moved = gel.view.pad_to_image(&(rest + Vec3::from(field.displacement_at(gel, rest.x, rest.y))));
    moved.map(|x| x as f32)
}

/// Positions by the law of FOTS (Zhao et al., arXiv 2404.19217), with all three parts evaluated at the initial
/// positions: dilation away from each touched marker by the depth of the dent there, and shear and twist with the
/// motion of the contact, decaying from its centre. The twist is (R(θ) − I)(M − G); the released codes write cos(θ −
/// 1) for cos θ − 1.
fn fots(gel: &Gel, law: &FotsSpec, field: &GelField, initial: &MarkerPositions) -> MarkerPositions {
    let (scale, middle) = (law.scale * 1e3, Vector2::new(160.0, 120.0));
    let centre_p = field.centre(gel);
    let centre = middle + scale * centre_p;
    let shift = scale * field.motion.at(&centre_p);
    let (sin, cos) = field.motion.angle.sin_cos();
    let initial = initial.map(|px| Vector2::from(px.map(f64::from)));
    let dents = initial.iter().filter_map(|px| {
        let p = (px - middle) / scale;
        let height = -field.displacement_at(gel, p.x, p.y)[2] * 1e3 * law.height_factor;
        (field.touches(gel, p.x, p.y) && height > 0.0).then_some(Dent { px: *px, height })
    });
    let dents: Vec<Dent> = dents.collect();
    initial.map(|px| {
        let arm = px - centre;
        let r2 = arm.dot(&arm);
        let turned = Vector2::new((cos - 1.0) * arm.x - sin * arm.y, sin * arm.x + (cos - 1.0) * arm.y);
        let mut moved = px + shift * (-law.shear * r2).exp() + turned * (-law.twist * r2).exp();
        for dent in &dents {
            let arm = px - dent.px;
            moved += dent.height * (-law.dilate * arm.dot(&arm)).exp() * arm;
        }
        [moved.x as f32, moved.y as f32]
    })
}

/// Touched marker as a source of dilation.
struct Dent {
    /// Initial position, px.
    px: Vector2<f64>,
    /// Depth of the gel there, mm times the height factor.
    height: f64,
}

/// Drawing of the markers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MarkerStyle {
    /// A dark dot at each current position.
    Dots,
    /// A yellow arrow from the initial towards the current position, three times as long as the motion.
    Arrows,
    /// A black arrow, twice as long as the motion and 2 px wide, as in SoftVTBench's release v0.2.
    BlackArrows,
}

/// Radius of a dot, px.
const DOT_RADIUS: f32 = 2.6;

/// Drawing of an arrow.
struct ArrowStyle {
    colour: [u8; 3],
    /// Length of a drawn arrow over the motion's, which is mostly below a few pixels.
    gain: f32,
    /// Half the width of the line, px.
    line_radius: f32,
    /// Length of the head over the arrow's.
    head: f32,
}

impl ArrowStyle {
    const YELLOW: Self = Self { colour: [255, 230, 40], gain: 3.0, line_radius: 0.8, head: 0.4 };
    const BLACK: Self = Self { colour: [0, 0, 0], gain: 2.0, line_radius: 1.0, head: 0.2 };

    /// Draws the motion of a marker.
    fn draw(&self, rgb: &mut [u8], from: [f32; 2], to: [f32; 2]) {
        let tip = [0, 1].map(|a| from[a] + self.gain * (to[a] - from[a]));
        let (dx, dy) = (tip[0] - from[0], tip[1] - from[1]);
        let length = dx.hypot(dy);
        capsule(rgb, from, tip, self.line_radius, self.colour);
        if length > 1.0 {
            let head = (self.head * length).min(5.0) / length;
            for side in [-0.6, 0.6] {
                let end = [tip[0] - head * (dx - side * dy), tip[1] - head * (dy + side * dx)];
                capsule(rgb, tip, end, self.line_radius, self.colour);
            }
        }
    }
}

/// Draws a line with round ends and antialiased edges.
fn capsule(rgb: &mut [u8], a: [f32; 2], b: [f32; 2], radius: f32, colour: [u8; 3]) {
    let [width, height] = IMAGE_SIZE;
    let margin = radius + 1.0;
    let range = |p: f32, q: f32, end: usize| {
        let low = (p.min(q) - margin).clamp(0.0, end as f32) as usize;
        let high = (p.max(q) + margin + 1.0).clamp(0.0, end as f32) as usize;
        low..high
    };
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length2 = dx * dx + dy * dy;
    for j in range(a[1], b[1], height) {
        for i in range(a[0], b[0], width) {
            let (x, y) = (i as f32 + 0.5 - a[0], j as f32 + 0.5 - a[1]);
            let t = if length2 > 0.0 { ((x * dx + y * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
            let cover = (radius + 0.5 - (x - t * dx).hypot(y - t * dy)).clamp(0.0, 1.0);
            let Some(pixel) = rgb.get_mut(3 * (j * width + i)..3 * (j * width + i) + 3) else { continue };
            for (value, &ink) in pixel.iter_mut().zip(&colour) {
                let old = f32::from(*value);
                *value = (old + cover * (f32::from(ink) - old)).round() as u8;
            }
        }
    }
}
