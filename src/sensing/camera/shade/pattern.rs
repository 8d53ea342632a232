//! Procedural materials: evaluates the masks and layers of a [`Visual`] at a point, filtered to the sampling distance.

use super::{noise, text_decal};
use crate::{
    scene::{Mask, Visual},
    sensing::camera::math::V3,
};

/// Material parameters at a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MaterialSample {
    /// Diffuse or metallic colour, linear RGB.
    pub(crate) albedo: V3,
    pub(crate) roughness: f32,
    pub(crate) metalness: f32,
    /// Fraction of the sky left visible by the object itself.
    pub(crate) sky_visibility: f32,
}

impl MaterialSample {
    /// Number of components of [`components`](Self::components).
    pub(crate) const COMPONENTS: usize = 6;

    /// Returns the components that textures store: albedo and roughness.
    pub(crate) fn texel(&self) -> [f32; 4] {
        [self.albedo.x, self.albedo.y, self.albedo.z, self.roughness]
    }

    /// Returns albedo, roughness, metalness and sky visibility.
    #[inline(always)]
    pub(crate) fn components(&self) -> [f32; Self::COMPONENTS] {
        let a = &self.albedo;
        [a.x, a.y, a.z, self.roughness, self.metalness, self.sky_visibility]
    }

    /// True if both samples differ at most in their sky visibility.
    pub(crate) fn is_same_material(&self, other: &Self) -> bool {
        self.albedo == other.albedo && self.roughness == other.roughness && self.metalness == other.metalness
    }
}

/// A visual evaluated at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VisualSample {
    pub(crate) material: MaterialSample,
    /// Height of the drawn relief above the surface, m.
    pub(crate) relief: f32,
}

/// Depth below the surface at which patterns are evaluated, m: a face on the border of a pattern shows the inner side.
const SAMPLE_DEPTH: f32 = 2e-5;

/// Evaluates `visual` at the point `p` (object frame, m) of a surface with unit normal `n`.
///
/// Details finer than `spacing` (m) along the surface are averaged.
pub(crate) fn sample_visual(visual: &Visual, p: &V3, n: &V3, spacing: f32) -> VisualSample {
    let p = &(p - n * SAMPLE_DEPTH);
    let to_v3 = |c: [f64; 3]| V3::from(c.map(|x| x as f32));
    let mut material = MaterialSample {
        albedo: to_v3(visual.albedo),
        roughness: visual.roughness as f32,
        metalness: visual.metalness as f32,
        sky_visibility: 1.0,
    };
    let mut relief = 0.0;
    for layer in &visual.layers {
        let mask = mask_value(&layer.mask, p, n, spacing);
        let alpha = mask * layer.opacity as f32;
        material.albedo += (to_v3(layer.albedo) - material.albedo) * alpha;
        material.roughness += (layer.roughness as f32 - material.roughness) * alpha;
        relief += mask * layer.relief_m as f32;
    }
    VisualSample { material, relief }
}

/// Size of the smallest feature of a visual, m; infinite if it has none.
pub(crate) fn finest_feature(visual: &Visual) -> f32 {
    fn mask_feature(mask: &Mask) -> f64 {
        match mask {
            Mask::Whole => f64::INFINITY,
            Mask::Gradient { from_m, to_m, .. } => (to_m - from_m).abs(),
            Mask::Noise { size_m, octaves, from, to, .. } => {
                let coarsest = size_m.iter().copied().fold(f64::INFINITY, f64::min);
                // A narrow range turns the noise into sharp edges.
                coarsest * 0.5_f64.powi(*octaves as i32 - 1) * (to - from).abs().min(1.0)
            }
            Mask::Both { masks } => masks.iter().map(|mask| mask_feature(mask)).fold(f64::INFINITY, f64::min),
            Mask::Inverse { mask } => mask_feature(mask),
            Mask::Inside { soft_m, .. } => *soft_m,
            // Varies with the normal only, whose detail is that of the mesh.
            Mask::Facing { .. } => f64::INFINITY,
            // Sharp edges.
            Mask::Text { .. }
            | Mask::Checker { .. }
            | Mask::Stripes { .. }
            | Mask::Rings { .. }
            | Mask::Boards { .. }
            | Mask::Seams { .. }
            | Mask::Specks { .. }
            | Mask::Weave { .. } => 0.0,
        }
    }
    visual.layers.iter().map(|layer| mask_feature(&layer.mask)).fold(f64::INFINITY, f64::min) as f32
}

/// True if a visual has printed text.
pub(crate) fn has_text(visual: &Visual) -> bool {
    fn mask_has_text(mask: &Mask) -> bool {
        match mask {
            Mask::Text { .. } => true,
            Mask::Both { masks } => masks.iter().any(|mask| mask_has_text(mask)),
            Mask::Inverse { mask } => mask_has_text(mask),
            _ => false,
        }
    }
    visual.layers.iter().any(|layer| mask_has_text(&layer.mask))
}

/// Value of a mask at `p`, 0..=1, averaged over about `spacing` along the surface.
fn mask_value(mask: &Mask, p: &V3, n: &V3, spacing: f32) -> f32 {
    // Length by which a step of `spacing` along the surface can advance in a direction at this cosine to the normal.
    let footprint = |cosine: f32| spacing * (1.0 - cosine * cosine).max(0.0).sqrt();
    match mask {
        Mask::Whole => 1.0,
        Mask::Checker { size_m } => {
            let size = *size_m as f32;
            // The product of three square waves of values ±1, each averaged over the footprint.
            let wave =
                |i: usize| 2.0 * pulse_wave(p[i] / (2.0 * size), 0.5, footprint(n[i]) / (2.0 * size)) - 1.0;
            0.5 + 0.5 * wave(0) * wave(1) * wave(2)
        }
        Mask::Stripes { axis, pitch_m, share } => {
            let pitch = *pitch_m as f32;
            pulse_wave(along(axis, p) / pitch, *share as f32, footprint(along(axis, n)) / pitch)
        }
        Mask::Gradient { axis, from_m, to_m } => {
            smoothstep((along(axis, p) - *from_m as f32) / (*to_m - *from_m) as f32)
        }
        Mask::Noise { size_m, octaves, from, to, seed } => {
            let size = size_m.map(|s| s as f32);
            let filter_width = spacing / size.iter().copied().fold(f32::INFINITY, f32::min).max(1e-6);
            let scaled = std::array::from_fn(|i| p[i] / size[i]);
            let value = noise::fractal_noise(scaled, *octaves, filter_width, *seed);
            smoothstep((value - *from as f32) / (*to - *from) as f32)
        }
        Mask::Rings { centre_m, pitch_m, wobble_m, seed } => {
            let (pitch, wobble) = (*pitch_m as f32, *wobble_m as f32);
            rings(&(p - V3::from(centre_m.map(|c| c as f32))), pitch, wobble, spacing, *seed)
        }
        Mask::Boards { length_m, width_m, seed } => board(p, *length_m as f32, *width_m as f32, *seed),
        Mask::Seams { length_m, width_m, gap_m } => {
            seams(p, *length_m as f32, *width_m as f32, *gap_m as f32, spacing)
        }
        Mask::Specks { spacing_m, radius_m, seed } => {
            specks(p, *spacing_m as f32, *radius_m as f32, spacing, *seed)
        }
        Mask::Weave { pitch_m } => weave(p, *pitch_m as f32, spacing),
        Mask::Facing { axis, from, to } => smoothstep((along(axis, n) - *from as f32) / (*to - *from) as f32),
        Mask::Inside { shape, soft_m } => {
            let width = (*soft_m as f32).max(spacing).max(1e-6);
            smoothstep(0.5 - shape.distance(&p.cast()) as f32 / width)
        }
        Mask::Text { decal } => text_decal::coverage(decal, p, n, spacing),
        Mask::Inverse { mask } => 1.0 - mask_value(mask, p, n, spacing),
        Mask::Both { masks } => masks.iter().map(|m| mask_value(m, p, n, spacing)).product(),
    }
}

/// Component of `p` along `axis`, which may have any length.
fn along(axis: &[f64; 3], p: &V3) -> f32 {
    let axis = V3::from(axis.map(|x| x as f32));
    p.dot(&axis) / axis.norm().max(1e-9)
}

fn smoothstep(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Mean over an interval of `width` around `x` of the wave of period 1 that is 1 on the first `duty` of each period.
fn pulse_wave(x: f32, duty: f32, width: f32) -> f32 {
    if width < 1e-5 {
        return if x - x.floor() < duty { 1.0 } else { 0.0 };
    }
    let integral = |x: f32| x.floor() * duty + (x - x.floor()).min(duty);
    ((integral(x + 0.5 * width) - integral(x - 0.5 * width)) / width).clamp(0.0, 1.0)
}

/// Wood rings about the z axis: brightness grows slowly across a ring and falls sharply at its edge.
fn rings(p: &V3, pitch: f32, wobble: f32, spacing: f32, seed: u32) -> f32 {
    let scaled = [p.x / (8.0 * wobble), p.y / (8.0 * wobble), p.z / (40.0 * wobble)];
    let bend = noise::fractal_noise(scaled, 2, 0.0, seed);
    let phase = ((p.x * p.x + p.y * p.y).sqrt() + 2.0 * wobble * (bend - 0.5)) / pitch;
    let t = phase - phase.floor();
    let ring = if t < 0.85 { (t / 0.85).powi(3) } else { 1.0 - (t - 0.85) / 0.15 };
    let fade = (2.0 - 2.0 * spacing / pitch).clamp(0.0, 1.0);
    0.3 + (ring - 0.3) * fade
}

/// A board of a floor: its number along x and across y, and the position in it as fractions of its length and width.
struct BoardPosition {
    cell: [i32; 2],
    fraction: [f32; 2],
}

/// Finds the board at `p`. Each row is shifted along x by a random fraction of the board length.
fn locate_board(p: &V3, length: f32, width: f32) -> BoardPosition {
    let y = p.y / width;
    let row = y.floor() as i32;
    let shift = noise::cell_random([row, 17, 5], 1)[0];
    let x = p.x / length + shift;
    BoardPosition { cell: [x.floor() as i32, row], fraction: [x - x.floor(), y - y.floor()] }
}

/// A random value per board.
fn board(p: &V3, length: f32, width: f32, seed: u32) -> f32 {
    let [column, row] = locate_board(p, length, width).cell;
    noise::cell_random([column, row, 3], seed)[1]
}

fn seams(p: &V3, length: f32, width: f32, gap: f32, spacing: f32) -> f32 {
    let [x, y] = locate_board(p, length, width).fraction;
    let seam = |t: f32, period: f32| {
        let d = t.min(1.0 - t) * period;
        ((0.5 * gap + 0.5 * spacing - d) / spacing.max(1e-6)).clamp(0.0, 1.0).min(gap / spacing.max(gap))
    };
    seam(x, length).max(seam(y, width))
}

/// Balls at jittered positions, one per cube of edge `cell`.
fn specks(p: &V3, cell: f32, radius: f32, spacing: f32, seed: u32) -> f32 {
    let own = p.map(|x| (x / cell).floor() as i32);
    let mut value: f32 = 0.0;
    for neighbour in 0..27 {
        let lattice = [own.x + neighbour % 3 - 1, own.y + neighbour / 3 % 3 - 1, own.z + neighbour / 9 - 1];
        let jitter = noise::cell_random(lattice, seed);
        let centre = V3::from_fn(|i, _| (lattice[i] as f32 + jitter[i]) * cell);
        let gap = (p - centre).norm() - radius;
        value = value.max((0.5 - gap / spacing.max(0.15 * radius)).clamp(0.0, 1.0));
    }
    value
}

/// Plain weave in x and y: each thread is highest along its middle.
fn weave(p: &V3, pitch: f32, spacing: f32) -> f32 {
    let (u, v) = (p.x / pitch, p.y / pitch);
    let is_warp_on_top = (u.floor() + v.floor()) as i32 & 1 == 0;
    let across = if is_warp_on_top { v - v.floor() } else { u - u.floor() };
    let thread = 4.0 * across * (1.0 - across);
    let fade = (2.0 - 2.0 * spacing / pitch).clamp(0.0, 1.0);
    2.0 / 3.0 + (thread - 2.0 / 3.0) * fade
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{geometry::shape::Shape, scene::Mask};

    fn value(of: &Mask, p: [f32; 3], n: [f32; 3], spacing: f32) -> f32 {
        mask_value(of, &p.into(), &n.into(), spacing)
    }

    #[test]
    fn a_facing_mask_follows_the_cosine_of_the_normal() {
        let up = Mask::Facing { axis: [0.0, 0.0, 3.0], from: 0.0, to: 1.0 };
        for (n, expected) in [([0.0, 0.0, 1.0], 1.0), ([1.0, 0.0, 0.0], 0.0), ([0.0, 0.0, -1.0], 0.0)] {
            assert_eq!(value(&up, [0.0; 3], n, 1e-3), expected);
        }
        assert!((value(&up, [0.0; 3], [0.75_f32.sqrt(), 0.0, 0.5], 1e-3) - 0.5).abs() < 1e-6);
        let inverse = Mask::Inverse { mask: Arc::new(up) };
        assert_eq!(value(&inverse, [0.0; 3], [0.0, 0.0, 1.0], 1e-3), 0.0);
    }

    #[test]
    fn the_edge_of_an_inside_mask_is_as_wide_as_requested_or_as_the_spacing() {
        let ball = |soft_m| Mask::Inside { shape: Arc::new(Shape::Sphere { radius: 0.01 }), soft_m };
        let at = |mask: &Mask, r: f32, spacing| value(mask, [r, 0.0, 0.0], [1.0, 0.0, 0.0], spacing);
        for (soft, spacing, half) in [(0.004, 1e-3, 0.002), (0.0, 1e-3, 0.0005)] {
            let mask = ball(soft);
            assert!((at(&mask, 0.01, spacing) - 0.5).abs() < 1e-5);
            assert_eq!(at(&mask, 0.01 - 1.01 * half, spacing), 1.0);
            assert_eq!(at(&mask, 0.01 + 1.01 * half, spacing), 0.0);
            // Smoothstep at 3/4.
            assert!((at(&mask, 0.01 - 0.5 * half, spacing) - 0.84375).abs() < 1e-4);
        }
    }
}
