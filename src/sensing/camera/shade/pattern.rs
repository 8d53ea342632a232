//! The look of a surface at a point: masks and layers evaluated, filtered to the spacing at which they are sampled.

use crate::scene::{Mask, Visual};
use crate::sensing::camera::{V3, shade::noise, shade::text_decal};

/// What shading needs to know of a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MaterialSample {
    /// Linear RGB.
    pub albedo: V3,
    pub roughness: f32,
    pub metalness: f32,
    /// Share of the sky that is not hidden by the object itself.
    pub open: f32,
}

impl MaterialSample {
    /// What textures hold: albedo and roughness.
    pub(crate) fn painted(&self) -> [f32; 4] {
        [self.albedo.x, self.albedo.y, self.albedo.z, self.roughness]
    }

    /// Albedo, roughness, metalness, openness.
    #[inline(always)]
    pub(crate) fn numbers(&self) -> [f32; 6] {
        let a = &self.albedo;
        [a.x, a.y, a.z, self.roughness, self.metalness, self.open]
    }
}

/// A visual, its numbers in single precision, at `p` (object frame, m) of a surface of unit normal `n`; what is finer than
/// `spacing` (m) along the surface is averaged out. The second number is the height of the drawn relief, m.
pub(crate) fn look(visual: &Visual, p: &V3, n: &V3, spacing: f32) -> (MaterialSample, f32) {
    // A little inside, so that a face that lies on a border of a pattern shows what is behind it.
    let p = &(p - n * INSIDE);
    let colour = |c: [f64; 3]| V3::from(c.map(|x| x as f32));
    let mut look = MaterialSample {
        albedo: colour(visual.albedo),
        roughness: visual.roughness as f32,
        metalness: visual.metalness as f32,
        open: 1.0,
    };
    let mut height = 0.0;
    for layer in &visual.layers {
        let mask = mask(&layer.mask, p, n, spacing);
        let share = mask * layer.opacity as f32;
        look.albedo += (colour(layer.albedo) - look.albedo) * share;
        look.roughness += (layer.roughness as f32 - look.roughness) * share;
        height += mask * layer.relief_m as f32;
    }
    (look, height)
}

/// Size of the smallest features of a visual, m; infinite if it has none.
pub(crate) fn finest(visual: &Visual) -> f32 {
    fn of(mask: &Mask) -> f64 {
        match mask {
            Mask::Whole => f64::INFINITY,
            Mask::Gradient { from_m, to_m, .. } => (to_m - from_m).abs(),
            Mask::Noise { size_m, octaves, from, to, .. } => {
                let least = size_m.iter().copied().fold(f64::INFINITY, f64::min);
                // Narrow ranges cut the noise to sharp edges.
                least * 0.5_f64.powi(*octaves as i32 - 1) * (to - from).abs().min(1.0)
            }
            Mask::Both { masks } => masks.iter().map(|mask| of(mask)).fold(f64::INFINITY, f64::min),
            Mask::Inverse { mask } => of(mask),
            Mask::Inside { soft_m, .. } => *soft_m,
            // As fine as the surface itself, whose own detail is told elsewhere.
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
    visual.layers.iter().map(|layer| of(&layer.mask)).fold(f64::INFINITY, f64::min) as f32
}

/// Whether text is printed on a visual.
pub(crate) fn printed(visual: &Visual) -> bool {
    fn of(mask: &Mask) -> bool {
        match mask {
            Mask::Text { .. } => true,
            Mask::Both { masks } => masks.iter().any(|mask| of(mask)),
            Mask::Inverse { mask } => of(mask),
            _ => false,
        }
    }
    visual.layers.iter().any(|layer| of(&layer.mask))
}

/// How far under the surface patterns are looked up, m.
const INSIDE: f32 = 2e-5;

/// The value of a mask at `p`, averaged over about `spacing` along the surface.
fn mask(mask: &Mask, p: &V3, n: &V3, spacing: f32) -> f32 {
    // What a step along the surface can change along a direction.
    let across = |cosine: f32| spacing * (1.0 - cosine * cosine).max(0.0).sqrt();
    match mask {
        Mask::Whole => 1.0,
        Mask::Checker { size_m } => {
            let size = *size_m as f32;
            // The product of three square waves of values ±1, each averaged over the spacing.
            let wave = |i: usize| 2.0 * pulse(p[i] / (2.0 * size), 0.5, across(n[i]) / (2.0 * size)) - 1.0;
            0.5 + 0.5 * wave(0) * wave(1) * wave(2)
        }
        Mask::Stripes { axis, pitch_m, share } => {
            let pitch = *pitch_m as f32;
            pulse(along(axis, p) / pitch, *share as f32, across(along(axis, n)) / pitch)
        }
        Mask::Gradient { axis, from_m, to_m } => {
            smooth((along(axis, p) - *from_m as f32) / (*to_m - *from_m) as f32)
        }
        Mask::Noise { size_m, octaves, from, to, seed } => {
            let size = size_m.map(|s| s as f32);
            let finest = spacing / size.iter().copied().fold(f32::INFINITY, f32::min).max(1e-6);
            let scaled = std::array::from_fn(|i| p[i] / size[i]);
            let value = noise::fractal(scaled, *octaves, finest, *seed);
            smooth((value - *from as f32) / (*to - *from) as f32)
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
        Mask::Facing { axis, from, to } => smooth((along(axis, n) - *from as f32) / (*to - *from) as f32),
        Mask::Inside { shape, soft_m } => {
            let width = (*soft_m as f32).max(spacing).max(1e-6);
            smooth(0.5 - shape.distance(&p.cast()) as f32 / width)
        }
        Mask::Text { decal } => text_decal::share(decal, p, n, spacing),
        Mask::Inverse { mask } => 1.0 - self::mask(mask, p, n, spacing),
        Mask::Both { masks } => masks.iter().map(|m| self::mask(m, p, n, spacing)).product(),
    }
}

fn along(axis: &[f64; 3], p: &V3) -> f32 {
    let axis = V3::from(axis.map(|x| x as f32));
    p.dot(&axis) / axis.norm().max(1e-9)
}

fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Mean over a box of `width` around `x` of the wave of period 1 that is 1 on the first `share` of it.
fn pulse(x: f32, share: f32, width: f32) -> f32 {
    if width < 1e-5 {
        return if x - x.floor() < share { 1.0 } else { 0.0 };
    }
    let integral = |x: f32| x.floor() * share + (x - x.floor()).min(share);
    ((integral(x + 0.5 * width) - integral(x - 0.5 * width)) / width).clamp(0.0, 1.0)
}

fn rings(p: &V3, pitch: f32, wobble: f32, spacing: f32, seed: u32) -> f32 {
    let bend =
        noise::fractal([p.x / (8.0 * wobble), p.y / (8.0 * wobble), p.z / (40.0 * wobble)], 2, 0.0, seed);
    let phase = ((p.x * p.x + p.y * p.y).sqrt() + 2.0 * wobble * (bend - 0.5)) / pitch;
    let t = phase - phase.floor();
    // Slow growth from light to dark, then a sharp edge.
    let ring = if t < 0.85 { (t / 0.85).powi(3) } else { 1.0 - (t - 0.85) / 0.15 };
    let kept = (2.0 - 2.0 * spacing / pitch).clamp(0.0, 1.0);
    0.3 + (ring - 0.3) * kept
}

/// Board numbers along and across; every other row is shifted by a share of its length of its own.
fn board_cell(p: &V3, length: f32, width: f32) -> ([i32; 2], [f32; 2]) {
    let across = p.y / width;
    let row = across.floor() as i32;
    let shift = noise::of_cell([row, 17, 5], 1)[0];
    let run = p.x / length + shift;
    ([run.floor() as i32, row], [run - run.floor(), across - across.floor()])
}

fn board(p: &V3, length: f32, width: f32, seed: u32) -> f32 {
    let ([run, row], _) = board_cell(p, length, width);
    noise::of_cell([run, row, 3], seed)[1]
}

fn seams(p: &V3, length: f32, width: f32, gap: f32, spacing: f32) -> f32 {
    let (_, [run, across]) = board_cell(p, length, width);
    let away = |t: f32, period: f32| {
        let d = t.min(1.0 - t) * period;
        ((0.5 * gap + 0.5 * spacing - d) / spacing.max(1e-6)).clamp(0.0, 1.0).min(gap / spacing.max(gap))
    };
    away(run, length).max(away(across, width))
}

fn specks(p: &V3, cell: f32, radius: f32, spacing: f32, seed: u32) -> f32 {
    let at = p.map(|x| (x / cell).floor() as i32);
    let mut most: f32 = 0.0;
    for neighbour in 0..27 {
        let of = [at.x + neighbour % 3 - 1, at.y + neighbour / 3 % 3 - 1, at.z + neighbour / 9 - 1];
        let jitter = noise::of_cell(of, seed);
        let centre = V3::from_fn(|i, _| (of[i] as f32 + jitter[i]) * cell);
        let gap = (p - centre).norm() - radius;
        most = most.max((0.5 - gap / spacing.max(0.15 * radius)).clamp(0.0, 1.0));
    }
    most
}

fn weave(p: &V3, pitch: f32, spacing: f32) -> f32 {
    let (u, v) = (p.x / pitch, p.y / pitch);
    let over = (u.floor() + v.floor()) as i32 & 1 == 0;
    let across = if over { v - v.floor() } else { u - u.floor() };
    let thread = 4.0 * across * (1.0 - across);
    let kept = (2.0 - 2.0 * spacing / pitch).clamp(0.0, 1.0);
    2.0 / 3.0 + (thread - 2.0 / 3.0) * kept
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{geometry::shape::Shape, scene::Mask};

    fn value(of: &Mask, p: [f32; 3], n: [f32; 3], spacing: f32) -> f32 {
        mask(of, &p.into(), &n.into(), spacing)
    }

    #[test]
    fn a_surface_faces_up_by_the_cosine_of_its_normal() {
        let up = Mask::Facing { axis: [0.0, 0.0, 3.0], from: 0.0, to: 1.0 };
        for (n, expected) in [([0.0, 0.0, 1.0], 1.0), ([1.0, 0.0, 0.0], 0.0), ([0.0, 0.0, -1.0], 0.0)] {
            assert_eq!(value(&up, [0.0; 3], n, 1e-3), expected);
        }
        assert!((value(&up, [0.0; 3], [0.75_f32.sqrt(), 0.0, 0.5], 1e-3) - 0.5).abs() < 1e-6);
        let inverse = Mask::Inverse { mask: Arc::new(up) };
        assert_eq!(value(&inverse, [0.0; 3], [0.0, 0.0, 1.0], 1e-3), 0.0);
    }

    #[test]
    fn the_border_of_a_shape_is_as_wide_as_asked_or_as_the_spacing() {
        let ball = |soft_m| Mask::Inside { shape: Arc::new(Shape::Sphere { radius: 0.01 }), soft_m };
        let at = |mask: &Mask, r: f32, spacing| value(mask, [r, 0.0, 0.0], [1.0, 0.0, 0.0], spacing);
        for (soft, spacing, half) in [(0.004, 1e-3, 0.002), (0.0, 1e-3, 0.0005)] {
            let mask = ball(soft);
            assert!((at(&mask, 0.01, spacing) - 0.5).abs() < 1e-5);
            assert_eq!(at(&mask, 0.01 - 1.01 * half, spacing), 1.0);
            assert_eq!(at(&mask, 0.01 + 1.01 * half, spacing), 0.0);
            // Smoothstep at a quarter of the width: 3/4 of the way.
            assert!((at(&mask, 0.01 - 0.5 * half, spacing) - 0.84375).abs() < 1e-4);
        }
    }
}
