//! Procedural materials: evaluates the masks and layers of a [`Visual`] at a point, filtered to the sampling distance.
//!
//! Noise comes from integer hashes, so that its bytes are the same on every machine.

use crate::camera::math::V3;
use softvt_geometry::Vec3;
use softvt_scene::{Mask, TextDecal, Visual};

/// Material parameters at a point of a surface: albedo (linear RGB), roughness, metalness, and the fraction of the sky
/// left visible by the object itself. The first four are those that textures store.
pub(crate) type MaterialSample = nalgebra::SVector<f32, 6>;
/// Index of the roughness in a [`MaterialSample`].
pub(crate) const ROUGHNESS: usize = 3;
/// Index of the metalness in a [`MaterialSample`].
pub(crate) const METALNESS: usize = 4;
/// Index of the sky visibility in a [`MaterialSample`].
pub(crate) const SKY_VISIBILITY: usize = 5;

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
    let [r, g, b] = visual.albedo;
    let mut material =
        MaterialSample::from([r, g, b, visual.roughness, visual.metalness, 1.0].map(|x| x as f32));
    let mut relief = 0.0;
    for layer in &visual.layers {
        let mask = mask_value(&layer.mask, p, n, spacing);
        let alpha = mask * layer.opacity as f32;
        let [r, g, b] = layer.albedo;
        for (value, target) in material.iter_mut().zip([r, g, b, layer.roughness]) {
            *value += (target as f32 - *value) * alpha;
        }
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
            Mask::Product { masks } => {
                masks.iter().map(|mask| mask_feature(mask)).fold(f64::INFINITY, f64::min)
            }
            Mask::Inverse { mask } => mask_feature(mask),
            Mask::Inside { soft_m, .. } => *soft_m,
            // Varies with the normal only, whose detail is that of the mesh.
            Mask::Facing { .. } => f64::INFINITY,
            // Sharp edges.
            _ => 0.0,
        }
    }
    visual.layers.iter().map(|layer| mask_feature(&layer.mask)).fold(f64::INFINITY, f64::min) as f32
}

/// True if a visual has printed text.
pub(crate) fn has_text(visual: &Visual) -> bool {
    fn mask_has_text(mask: &Mask) -> bool {
        match mask {
            Mask::Text { .. } => true,
            Mask::Product { masks } => masks.iter().any(|mask| mask_has_text(mask)),
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
            let value = fractal_noise(scaled, *octaves, filter_width, *seed);
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
        Mask::Text { decal } => text_coverage(decal, p, n, spacing),
        Mask::Inverse { mask } => 1.0 - mask_value(mask, p, n, spacing),
        Mask::Product { masks } => masks.iter().map(|m| mask_value(m, p, n, spacing)).product(),
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
    let bend = fractal_noise(scaled, 2, 0.0, seed);
    let phase = ((p.x * p.x + p.y * p.y).sqrt() + 2.0 * wobble * (bend - 0.5)) / pitch;
    let t = phase - phase.floor();
    let ring = if t < 0.85 { (t / 0.85).powi(3) } else { 1.0 - (t - 0.85) / 0.15 };
    let fade = (2.0 - 2.0 * spacing / pitch).clamp(0.0, 1.0);
    0.3 + (ring - 0.3) * fade
}

/// Position on a floor in units of its boards' length and width. Each row is shifted along x by a random fraction of
/// the board length.
fn board_position(p: &V3, length: f32, width: f32) -> [f32; 2] {
    let y = p.y / width;
    [p.x / length + cell_random([y.floor() as i32, 17, 5], 1)[0], y]
}

/// A random value per board.
fn board(p: &V3, length: f32, width: f32, seed: u32) -> f32 {
    let [column, row] = board_position(p, length, width).map(|x| x.floor() as i32);
    cell_random([column, row, 3], seed)[1]
}

fn seams(p: &V3, length: f32, width: f32, gap: f32, spacing: f32) -> f32 {
    let [x, y] = board_position(p, length, width).map(|x| x - x.floor());
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
        let jitter = cell_random(lattice, seed);
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

/// Minimum cosine between the normal of a printed surface and the direction of the text.
const MIN_FACING_COSINE: f32 = 0.1;
/// Maximum distance of a printed surface from the cylinder of a wrapped line, in radii of the cylinder.
const MAX_RADIUS_DEVIATION: f64 = 0.5;

/// Fraction of the square of edge `spacing` (m) about `p` (object frame, m) that letters cover, on a
/// surface of normal `n`.
fn text_coverage(decal: &TextDecal, p: &V3, n: &V3, spacing: f32) -> f32 {
    let Some([right, up]) = text_position(decal, &p.cast(), n) else { return 0.0 };
    let (sin, cos) = decal.line.turn.sin_cos();
    let (x, y) = (right * cos + up * sin, up * cos - right * sin);
    decal.coverage().share(x, y, f64::from(spacing)) as f32
}

/// Position of a surface point relative to the middle of the line, to the right and up as seen by the viewer, m;
/// `None` if the point is outside the printed area.
fn text_position(decal: &TextDecal, p: &Vec3, n: &V3) -> Option<[f64; 2]> {
    let line = &decal.line;
    let middle = Vec3::from(line.at);
    let facing = Vec3::from(line.facing).normalize();
    if let Some(radius) = line.wrap_m {
        let outwards = Vec3::new(p.x, p.y, 0.0);
        let faces_out =
            f64::from(n.x) * p.x + f64::from(n.y) * p.y > f64::from(MIN_FACING_COSINE) * outwards.norm();
        if !faces_out || (outwards.norm() - radius).abs() > MAX_RADIUS_DEVIATION * radius {
            return None;
        }
        let angle = (facing.x * p.y - facing.y * p.x).atan2(facing.x * p.x + facing.y * p.y);
        return Some([radius * angle, p.z - middle.z]);
    }
    let head = if facing.z.abs() > 0.999 { Vec3::y() } else { Vec3::z() };
    let up = (head - facing * facing.dot(&head)).normalize();
    let offset = p - middle;
    let depth = 0.5 * decal.coverage().length_m() + line.height_m;
    let is_printed =
        n.cast::<f64>().dot(&facing) > f64::from(MIN_FACING_COSINE) && offset.dot(&facing).abs() < depth;
    is_printed.then(|| [offset.dot(&up.cross(&facing)), offset.dot(&up)])
}

/// Hashes three words to three words (`pcg3d` of Jarzynski & Olano, Hash Functions for GPU Rendering, JCGT 9(3), 2020).
fn pcg3d(mut v: [u32; 3]) -> [u32; 3] {
    let mix = |v: &mut [u32; 3]| {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[2]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
    };
    v = v.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    v
}

/// Returns three pseudo-random numbers in 0..1 for a cell of the integer lattice.
fn cell_random(cell: [i32; 3], seed: u32) -> [f32; 3] {
    let word = |i: usize, salt: u32| (cell[i] as u32).wrapping_add(seed.wrapping_mul(salt));
    let words = pcg3d([word(0, 0x9E37_79B9), word(1, 0x85EB_CA6B), word(2, 0xC2B2_AE35)]);
    words.map(|w| (w >> 8) as f32 * (1.0 / 16_777_216.0))
}

/// Value noise with features of unit size, 0..=1, mean 0.5: lattice values blended by quintics
/// (Perlin, Improving Noise, 2002).
fn value_noise(p: [f32; 3], seed: u32) -> f32 {
    let cell = p.map(|x| x.floor() as i32);
    let f: [f32; 3] = std::array::from_fn(|i| p[i] - cell[i] as f32);
    let s = f.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let corner = |c: usize| {
        let lattice = std::array::from_fn(|axis| cell[axis].wrapping_add((c >> axis & 1) as i32));
        cell_random(lattice, seed)[0]
    };
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let along_x: [f32; 4] = std::array::from_fn(|i| lerp(corner(2 * i), corner(2 * i + 1), s[0]));
    lerp(lerp(along_x[0], along_x[1], s[1]), lerp(along_x[2], along_x[3], s[1]), s[2])
}

/// Sums octaves of value noise, each half the size and weight of the previous one, 0..=1.
///
/// Octaves finer than `filter_width` (in units of the coarsest feature) fade to their mean, which prevents aliasing.
fn fractal_noise(p: [f32; 3], octaves: u32, filter_width: f32, seed: u32) -> f32 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for octave in 0..octaves {
        let scale = (1_u32 << octave) as f32;
        let weight = 1.0 / scale;
        let fade = (2.0 - 2.0 * filter_width * scale).clamp(0.0, 1.0);
        let noise =
            if fade > 0.0 { value_noise(p.map(|x| x * scale), seed.wrapping_add(octave)) - 0.5 } else { 0.0 };
        sum += weight * fade * noise;
        weights += weight;
    }
    // A sum of independent octaves varies less than one of them; the factor restores about the same spread.
    (0.5 + 1.5 * sum / weights).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use softvt_geometry::shape::Shape;
    use softvt_scene::LabelLine;

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

    fn text_value(line: &LabelLine, p: [f64; 3], n: [f32; 3]) -> f32 {
        let p = Vec3::from(p).cast();
        text_coverage(&TextDecal::new(line.clone()), &p, &n.into(), 5e-4)
    }

    /// Coverage to the left and to the right of the middle; an L has more on its left.
    fn sides(line: &LabelLine, n: [f32; 3], place: impl Fn(f64, f64) -> [f64; 3]) -> [f32; 2] {
        [-1.0, 1.0].map(|side| {
            let all = (1..=12).flat_map(|i| (-12..=12).map(move |j| (f64::from(i), f64::from(j))));
            all.map(|(i, j)| text_value(line, place(side * i * 5e-4, j * 5e-4), n)).sum()
        })
    }

    #[test]
    fn text_is_upright_and_not_mirrored_seen_from_the_direction_it_faces() {
        let line = |facing: [f64; 3]| LabelLine {
            text: "L".into(),
            height_m: 0.01,
            weight: 0.1,
            at: [0.001, 0.002, 0.003],
            facing,
            ..LabelLine::default()
        };
        // The viewer's right and up for each direction.
        for (n, right, up) in [
            ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
            ([-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ] {
            let facing = line(n.map(f64::from));
            let place = |r: f64, u: f64| std::array::from_fn(|i| facing.at[i] + r * right[i] + u * up[i]);
            let [left, other] = sides(&facing, n, place);
            assert!(left > 1.5 * other && other > 0.5, "{n:?}: {left} {other}");
            let foot = text_value(&facing, place(0.0, -0.0044), n);
            let head = text_value(&facing, place(0.0, 0.0044), n);
            assert!(foot > 0.5 && head == 0.0, "{n:?}: the bar of an L is at the bottom: {foot} {head}");
            assert_eq!(
                text_value(&facing, place(0.0, -0.0044), n.map(|x: f32| -x)),
                0.0,
                "the back is blank"
            );
        }
    }

    #[test]
    fn a_wrapped_line_follows_the_cylinder_and_turn_rotates_a_line() {
        let line = LabelLine {
            text: "L".into(),
            height_m: 0.01,
            weight: 0.1,
            at: [0.0, 0.0, 0.05],
            facing: [0.0, -2.0, 0.0],
            wrap_m: Some(0.01),
            ..LabelLine::default()
        };
        let n = |turn: f64| [turn.sin() as f32, -turn.cos() as f32, 0.0];
        let place = |r: f64, u: f64| [0.01 * (r / 0.01).sin(), -0.01 * (r / 0.01).cos(), 0.05 + u];
        let ink = |r: f64| {
            let at = |j: i32| text_value(&line, place(r, f64::from(j) * 4e-4), n(r / 0.01));
            (-14..=14).map(at).sum::<f32>()
        };
        let [left, right] =
            [-1.0, 1.0].map(|side| (1..=12).map(|i| ink(side * f64::from(i) * 5e-4)).sum::<f32>());
        assert!(left > 1.5 * right && right > 0.5, "{left} {right}");
        assert_eq!(text_value(&line, [0.0, 0.01, 0.05], [0.0, 1.0, 0.0]), 0.0, "the far side is blank");
        let upright = LabelLine { wrap_m: None, facing: [0.0, 0.0, 1.0], at: [0.0; 3], ..line };
        let turned = LabelLine { turn: std::f64::consts::FRAC_PI_2, ..upright.clone() };
        for (r, u) in [(-0.002, 0.003), (0.001, -0.0044), (0.002, 0.002)] {
            let up = [0.0, 0.0, 1.0];
            let before = text_value(&upright, [r, u, 0.0], up);
            assert!(
                (before - text_value(&turned, [-u, r, 0.0], up)).abs() < 1e-5,
                "a quarter turn counter-clockwise"
            );
        }
    }
}
