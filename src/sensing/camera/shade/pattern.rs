//! Procedural materials: evaluates the masks and layers of a [`Visual`] at a point, filtered to the sampling distance.
//!
//! Noise comes from integer hashes, so that its bytes are the same on every machine.

use wide::{bytemuck::cast, i32x8, u32x8};

use crate::camera::math::{LANES, V3, Vec3x8, f32x8, sum_lanes};
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

/// A point of a surface at which a visual is evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatternPoint {
    /// Position, object frame, m.
    pub(crate) p: V3,
    /// Unit normal, object frame.
    pub(crate) n: V3,
}

/// Points of surfaces at which a visual is evaluated together.
struct PatternPoints {
    /// Positions, object frame, m.
    p: Vec3x8,
    /// Unit normals, object frame.
    n: Vec3x8,
    /// Number of lanes that are used.
    count: usize,
}

impl PatternPoints {
    /// One to eight points; further lanes repeat the last one.
    fn new(points: &[PatternPoint]) -> Self {
        let lanes = |of: fn(&PatternPoint) -> V3| {
            let component =
                |axis: usize| std::array::from_fn(|lane| of(&points[lane.min(points.len() - 1)])[axis]);
            Vec3x8::from_arrays(&[component(0), component(1), component(2)])
        };
        Self { p: lanes(|point| point.p), n: lanes(|point| point.n), count: points.len() }
    }

    /// A ball around the points, about their mean; lanes that are not used count as well.
    fn bounding_ball(&self) -> BoundingBall {
        let share = f32x8::splat(1.0 / LANES as f32);
        let centre = V3::from([self.p.x, self.p.y, self.p.z].map(|x| sum_lanes(x * share)));
        let away = self.p - Vec3x8::splat(&centre);
        let radius2 = away.dot(away).to_array().into_iter().fold(0.0, f32::max);
        BoundingBall { centre, radius: radius2.sqrt() }
    }

    /// The value of a function of position and normal in each lane.
    fn each(&self, value: impl Fn(&V3, &V3) -> f32) -> f32x8 {
        let (p, n) = (self.p.to_arrays(), self.n.to_arrays());
        let lane = |of: &[[f32; LANES]; 3], lane: usize| V3::new(of[0][lane], of[1][lane], of[2][lane]);
        let mut values = [0.0; LANES];
        for (index, known) in values.iter_mut().enumerate().take(self.count) {
            *known = value(&lane(&p, index), &lane(&n, index));
        }
        f32x8::new(values)
    }
}

/// A ball around points.
struct BoundingBall {
    centre: V3,
    radius: f32,
}

/// Margin for the errors of first-order distances, which can exceed true ones.
const DISTANCE_MARGIN: f32 = 2.0;

/// Depth below the surface at which patterns are evaluated, m: a face on the border of a pattern shows the inner side.
const SAMPLE_DEPTH: f32 = 2e-5;

/// Evaluates `visual` at points of surfaces, eight at a time, and passes the sample of each to `take` in their order.
///
/// Details finer than `spacing` (m) along the surface are averaged.
pub(crate) fn sample_visual(
    visual: &Visual,
    points: &[PatternPoint],
    spacing: f32,
    mut take: impl FnMut(usize, VisualSample),
) {
    for (block, points) in points.chunks(LANES).enumerate() {
        let mut at = PatternPoints::new(points);
        at.p = at.p - at.n * f32x8::splat(SAMPLE_DEPTH);
        let [r, g, b] = visual.albedo;
        let mut material = [r, g, b, visual.roughness].map(|x| f32x8::splat(x as f32));
        if let Some(colours) = &visual.colours {
            let tint = |channel: usize| at.each(|p, _| colours.at(&p.cast(), f64::from(spacing))[channel]);
            (0..3).for_each(|channel| material[channel] *= tint(channel));
        }
        let mut relief = f32x8::ZERO;
        for layer in &visual.layers {
            let mask = mask_value(&layer.mask, &at, spacing);
            let alpha = mask * f32x8::splat(layer.opacity as f32);
            let [r, g, b] = layer.albedo;
            for (value, target) in material.iter_mut().zip([r, g, b, layer.roughness]) {
                *value += (f32x8::splat(target as f32) - *value) * alpha;
            }
            relief += mask * f32x8::splat(layer.relief_m as f32);
        }
        let (material, relief) = (material.map(f32x8::to_array), relief.to_array());
        for lane in 0..at.count {
            let [r, g, b, roughness] = material.map(|values| values[lane]);
            let material = MaterialSample::from([r, g, b, roughness, visual.metalness as f32, 1.0]);
            take(LANES * block + lane, VisualSample { material, relief: relief[lane] });
        }
    }
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
            // Varies with the normal only, whose detail is the mesh's.
            Mask::Facing { .. } => f64::INFINITY,
            // Sharp edges.
            _ => 0.0,
        }
    }
    // An image may have any detail.
    let finest = if visual.colours.is_some() { 0.0 } else { f64::INFINITY };
    visual.layers.iter().map(|layer| mask_feature(&layer.mask)).fold(finest, f64::min) as f32
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

/// Values of a mask, 0..=1, averaged over about `spacing` along the surface.
fn mask_value(mask: &Mask, at: &PatternPoints, spacing: f32) -> f32x8 {
    let PatternPoints { p, n, .. } = at;
    // Length by which a step of `spacing` along the surface can advance in a direction at this cosine to the normal.
    let footprint =
        |cosine: f32x8| (f32x8::ONE - cosine * cosine).fast_max(f32x8::ZERO).sqrt() * f32x8::splat(spacing);
    let splat = |x: f64| f32x8::splat(x as f32);
    match mask {
        Mask::Whole => f32x8::ONE,
        Mask::Checker { size_m } => {
            let period = f32x8::splat(2.0 * *size_m as f32);
            // The product of three square waves of values ±1, each averaged over the footprint.
            let wave = |p: f32x8, n: f32x8| {
                f32x8::splat(2.0) * pulse_wave(p / period, 0.5, footprint(n) / period) - f32x8::ONE
            };
            let half = f32x8::HALF;
            half + half * wave(p.x, n.x) * wave(p.y, n.y) * wave(p.z, n.z)
        }
        Mask::Stripes { axis, pitch_m, share } => {
            let pitch = splat(*pitch_m);
            pulse_wave(along(axis, p) / pitch, *share as f32, footprint(along(axis, n)) / pitch)
        }
        Mask::Gradient { axis, from_m, to_m } => {
            smoothstep((along(axis, p) - splat(*from_m)) / f32x8::splat((*to_m - *from_m) as f32))
        }
        Mask::Noise { size_m, octaves, from, to, seed } => {
            let size = size_m.map(|s| s as f32);
            let filter_width = spacing / size.iter().copied().fold(f32::INFINITY, f32::min).max(1e-6);
            let [x, y, z] = size.map(f32x8::splat);
            let scaled = Vec3x8 { x: p.x / x, y: p.y / y, z: p.z / z };
            let value = fractal_noise(scaled, *octaves, filter_width, *seed);
            smoothstep((value - splat(*from)) / f32x8::splat((*to - *from) as f32))
        }
        Mask::Rings { centre_m, pitch_m, wobble_m, seed } => {
            let (pitch, wobble) = (*pitch_m as f32, *wobble_m as f32);
            rings(*p - Vec3x8::splat(&V3::from(centre_m.map(|c| c as f32))), pitch, wobble, spacing, *seed)
        }
        Mask::Boards { length_m, width_m, seed } => board(p, *length_m as f32, *width_m as f32, *seed),
        Mask::Seams { length_m, width_m, gap_m } => {
            seams(p, *length_m as f32, *width_m as f32, *gap_m as f32, spacing)
        }
        Mask::Specks { spacing_m, radius_m, seed } => {
            specks(p, *spacing_m as f32, *radius_m as f32, spacing, *seed)
        }
        Mask::Weave { pitch_m } => weave(p, *pitch_m as f32, spacing),
        Mask::Facing { axis, from, to } => {
            smoothstep((along(axis, n) - splat(*from)) / f32x8::splat((*to - *from) as f32))
        }
        Mask::Inside { shape, soft_m } => {
            let width = (*soft_m as f32).max(spacing).max(1e-6);
            let distance = |p: &V3| shape.distance(&p.cast()) as f32;
            let ball = at.bounding_ball();
            let from_centre = distance(&ball.centre);
            // Far from the border all points are inside or all outside.
            if from_centre.abs() > DISTANCE_MARGIN * (ball.radius + 0.5 * width) {
                return f32x8::splat(if from_centre < 0.0 { 1.0 } else { 0.0 });
            }
            smoothstep(f32x8::HALF - at.each(|p, _| distance(p)) / f32x8::splat(width))
        }
        Mask::Text { decal } => at.each(|p, n| text_coverage(decal, p, n, spacing)),
        Mask::Inverse { mask } => f32x8::ONE - mask_value(mask, at, spacing),
        Mask::Product { masks } => {
            let mut product = f32x8::ONE;
            for mask in masks {
                // The remaining masks may be costly.
                if product == f32x8::ZERO {
                    break;
                }
                product *= mask_value(mask, at, spacing);
            }
            product
        }
    }
}

/// Component of `p` along `axis`, which may have any length.
fn along(axis: &[f64; 3], p: &Vec3x8) -> f32x8 {
    let axis = V3::from(axis.map(|x| x as f32));
    p.dot(Vec3x8::splat(&axis)) / f32x8::splat(axis.norm().max(1e-9))
}

fn unit(t: f32x8) -> f32x8 {
    t.fast_max(f32x8::ZERO).fast_min(f32x8::ONE)
}

fn smoothstep(t: f32x8) -> f32x8 {
    let t = unit(t);
    t * t * (f32x8::splat(3.0) - f32x8::splat(2.0) * t)
}

fn fraction(x: f32x8) -> f32x8 {
    x - x.floor()
}

/// Mean over an interval of `width` around `x` of the wave of period 1 that is 1 on the first `duty` of each period.
fn pulse_wave(x: f32x8, duty: f32, width: f32x8) -> f32x8 {
    let duty = f32x8::splat(duty);
    let integral = |x: f32x8| x.floor() * duty + fraction(x).fast_min(duty);
    let half = f32x8::HALF * width;
    let mean = unit((integral(x + half) - integral(x - half)) / width);
    let point = fraction(x).simd_lt(duty).select(f32x8::ONE, f32x8::ZERO);
    width.simd_lt(f32x8::splat(1e-5)).select(point, mean)
}

/// Wood rings about the z axis: brightness grows slowly across a ring and falls sharply at its edge.
fn rings(p: Vec3x8, pitch: f32, wobble: f32, spacing: f32, seed: u32) -> f32x8 {
    let (across, along) = (f32x8::splat(8.0 * wobble), f32x8::splat(40.0 * wobble));
    let scaled = Vec3x8 { x: p.x / across, y: p.y / across, z: p.z / along };
    let bend = fractal_noise(scaled, 2, 0.0, seed);
    let wobbling = f32x8::splat(2.0 * wobble) * (bend - f32x8::HALF);
    let t = fraction(((p.x * p.x + p.y * p.y).sqrt() + wobbling) / f32x8::splat(pitch));
    let (edge, rise) = (f32x8::splat(0.85), t / f32x8::splat(0.85));
    let fall = f32x8::ONE - (t - edge) / f32x8::splat(0.15);
    let ring = t.simd_lt(edge).select(rise * rise * rise, fall);
    let fade = (2.0 - 2.0 * spacing / pitch).clamp(0.0, 1.0);
    let mean = f32x8::splat(0.3);
    mean + (ring - mean) * f32x8::splat(fade)
}

/// Position on a floor in units of its boards' length and width. Each row is shifted along x by a random fraction
/// of the board length.
fn board_position(p: &Vec3x8, length: f32, width: f32) -> [f32x8; 2] {
    let y = p.y / f32x8::splat(width);
    let shift = cell_random([cell(y), i32x8::splat(17), i32x8::splat(5)], 1)[0];
    [p.x / f32x8::splat(length) + shift, y]
}

/// A random value per board.
fn board(p: &Vec3x8, length: f32, width: f32, seed: u32) -> f32x8 {
    let [column, row] = board_position(p, length, width).map(cell);
    cell_random([column, row, i32x8::splat(3)], seed)[1]
}

fn seams(p: &Vec3x8, length: f32, width: f32, gap: f32, spacing: f32) -> f32x8 {
    let [x, y] = board_position(p, length, width).map(fraction);
    let (reach, most) = (f32x8::splat(0.5 * gap + 0.5 * spacing), f32x8::splat(gap / spacing.max(gap)));
    let seam = |t: f32x8, period: f32| {
        let d = t.fast_min(f32x8::ONE - t) * f32x8::splat(period);
        unit((reach - d) / f32x8::splat(spacing.max(1e-6))).fast_min(most)
    };
    seam(x, length).fast_max(seam(y, width))
}

/// Balls at jittered positions, one per cube of edge `edge`.
fn specks(p: &Vec3x8, edge: f32, radius: f32, spacing: f32, seed: u32) -> f32x8 {
    let (edge, radius_x8) = (f32x8::splat(edge), f32x8::splat(radius));
    let own = [p.x, p.y, p.z].map(|x| cell(x / edge));
    let softness = f32x8::splat(spacing.max(0.15 * radius));
    let mut value = f32x8::ZERO;
    for neighbour in 0..27 {
        let offset = [neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1];
        let lattice: [i32x8; 3] = std::array::from_fn(|axis| own[axis] + i32x8::splat(offset[axis]));
        let jitter = cell_random(lattice, seed);
        let [x, y, z] = std::array::from_fn(|axis| (f32x8::from_i32x8(lattice[axis]) + jitter[axis]) * edge);
        let away = *p - Vec3x8 { x, y, z };
        let gap = away.dot(away).sqrt() - radius_x8;
        value = value.fast_max(unit(f32x8::HALF - gap / softness));
    }
    value
}

/// Plain weave in x and y: each thread is highest along its middle.
fn weave(p: &Vec3x8, pitch: f32, spacing: f32) -> f32x8 {
    let [u, v] = [p.x, p.y].map(|x| x / f32x8::splat(pitch));
    let parity = fraction((u.floor() + v.floor()) * f32x8::HALF);
    let across = parity.simd_lt(f32x8::splat(0.25)).select(fraction(v), fraction(u));
    let thread = f32x8::splat(4.0) * across * (f32x8::ONE - across);
    let fade = (2.0 - 2.0 * spacing / pitch).clamp(0.0, 1.0);
    let mean = f32x8::splat(2.0 / 3.0);
    mean + (thread - mean) * f32x8::splat(fade)
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
    let up = line.up(&facing);
    let offset = p - middle;
    let depth = 0.5 * decal.coverage().length_m() + line.height_m;
    let is_printed =
        n.cast::<f64>().dot(&facing) > f64::from(MIN_FACING_COSINE) && offset.dot(&facing).abs() < depth;
    is_printed.then(|| [offset.dot(&up.cross(&facing)), offset.dot(&up)])
}

/// Hashes three words to three words (`pcg3d` of Jarzynski & Olano, Hash Functions for GPU Rendering, JCGT 9(3), 2020).
fn pcg3d(mut v: [u32x8; 3]) -> [u32x8; 3] {
    let mix = |v: &mut [u32x8; 3]| {
        v[0] += v[1] * v[2];
        v[1] += v[2] * v[0];
        v[2] += v[0] * v[1];
    };
    v = v.map(|x| x * u32x8::splat(1_664_525) + u32x8::splat(1_013_904_223));
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    v
}

/// The integer below each number.
fn cell(x: f32x8) -> i32x8 {
    x.floor().fast_trunc_int()
}

/// Returns three pseudo-random numbers in 0..1 for cells of the integer lattice.
fn cell_random(cell: [i32x8; 3], seed: u32) -> [f32x8; 3] {
    let word = |i: usize, salt: u32| {
        let own: u32x8 = cast(cell[i]);
        own + u32x8::splat(seed.wrapping_mul(salt))
    };
    let words = pcg3d([word(0, 0x9E37_79B9), word(1, 0x85EB_CA6B), word(2, 0xC2B2_AE35)]);
    words.map(|w| f32x8::from_i32x8(cast(w >> 8)) * f32x8::splat(1.0 / 16_777_216.0))
}

/// Value noise with features of unit size, 0..=1, mean 0.5: lattice values blended by quintics
/// (Perlin, Improving Noise, 2002).
fn value_noise(p: Vec3x8, seed: u32) -> f32x8 {
    let p = [p.x, p.y, p.z];
    let own = p.map(cell);
    let s = p.map(|x| {
        let t = fraction(x);
        t * t * t * (t * (t * f32x8::splat(6.0) - f32x8::splat(15.0)) + f32x8::splat(10.0))
    });
    let corner = |c: usize| {
        let lattice = std::array::from_fn(|axis| own[axis] + i32x8::splat((c >> axis & 1) as i32));
        cell_random(lattice, seed)[0]
    };
    let lerp = |a: f32x8, b: f32x8, t: f32x8| a + (b - a) * t;
    let along_x: [f32x8; 4] = std::array::from_fn(|i| lerp(corner(2 * i), corner(2 * i + 1), s[0]));
    lerp(lerp(along_x[0], along_x[1], s[1]), lerp(along_x[2], along_x[3], s[1]), s[2])
}

/// Sums octaves of value noise, each half the size and weight of the previous one, 0..=1.
///
/// Octaves finer than `filter_width` (in units of the coarsest feature) fade to their mean, which prevents aliasing.
fn fractal_noise(p: Vec3x8, octaves: u32, filter_width: f32, seed: u32) -> f32x8 {
    let (mut sum, mut weights) = (f32x8::ZERO, 0.0);
    for octave in 0..octaves {
        let scale = (1_u32 << octave) as f32;
        let weight = 1.0 / scale;
        let fade = (2.0 - 2.0 * filter_width * scale).clamp(0.0, 1.0);
        if fade > 0.0 {
            let noise = value_noise(p * f32x8::splat(scale), seed.wrapping_add(octave)) - f32x8::HALF;
            sum += f32x8::splat(weight * fade) * noise;
        }
        weights += weight;
    }
    // A sum of independent octaves varies less than one of them; the factor restores about the same spread.
    unit(f32x8::HALF + f32x8::splat(1.5) * sum / f32x8::splat(weights))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use softvt_geometry::shape::Shape;
    use softvt_scene::LabelLine;

    fn value(of: &Mask, p: [f32; 3], n: [f32; 3], spacing: f32) -> f32 {
        mask_value(of, &PatternPoints::new(&[PatternPoint { p: p.into(), n: n.into() }]), spacing).to_array()
            [0]
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
