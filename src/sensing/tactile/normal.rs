//! The pressure under a pressed shape: conjugate gradients on the touching cells (Polonsky & Keer, Wear 231 (1999) 206),
//! in which the total force is given and the depth is found.

use super::gel::{Gel, Scratch};

/// Iterations end when the gap of the touching cells is this share of the depth (RMS).
const TOLERANCE: f64 = 2e-3;
/// Most iterations; a sphere takes 6, ridges 15.
const MOST: usize = 60;

/// A solved pressing.
#[derive(Clone, Debug)]
pub(super) struct Pressed {
    /// Pressure, Pa.
    pub pressure: Vec<f32>,
    /// How far the shape is pushed in beyond where it is given, m.
    pub push: f64,
}

/// Presses a shape `gap` (m above the untouched gel; infinite where there is none) until the pressure sums up to `force`
/// (N). `None` if there is nothing to press.
pub(super) fn press(gel: &Gel, gap: &[f32], force: f64, scratch: &mut Scratch) -> Option<Pressed> {
    let area = gel.cell * gel.cell;
    let total = (force / area) as f32;
    let mut p = foundation(gap, total, 1.0 / long_wave(gel, scratch))?;
    let n = gap.len();
    let (mut residual, mut direction, mut moved) = (vec![0.0_f32; n], vec![0.0_f32; n], vec![0.0_f32; n]);
    let (mut before, mut keep, mut push) = (1.0_f64, 0.0_f32, 0.0);
    for _ in 0..MOST {
        convolve(gel, &p, &mut residual, scratch);
        let depth = mean(&p, residual.iter().zip(gap).map(|(u, g)| u + g));
        push = f64::from(depth);
        let mut now = 0.0_f64;
        let mut touching = 0_u32;
        let mut deepest = 0.0_f32;
        for c in 0..n {
            deepest = if p[c] > 0.0 { deepest.max(residual[c]) } else { deepest };
            residual[c] = residual[c] + gap[c] - depth;
            if p[c] > 0.0 {
                now += f64::from(residual[c] * residual[c]);
                touching += 1;
            }
        }
        if (now / f64::from(touching)).sqrt() < TOLERANCE * f64::from(deepest) {
            break;
        }
        let share = keep * (now / before) as f32;
        for c in 0..n {
            direction[c] = if p[c] > 0.0 { share * direction[c] - residual[c] } else { 0.0 };
        }
        before = now;
        convolve(gel, &direction, &mut moved, scratch);
        let level = mean(&p, moved.iter().copied());
        let (mut down, mut curvature) = (0.0_f64, 0.0_f64);
        for c in (0..n).filter(|&c| p[c] > 0.0) {
            down -= f64::from(residual[c] * direction[c]);
            curvature += f64::from((moved[c] - level) * direction[c]);
        }
        if !(curvature > 0.0) {
            break;
        }
        keep = advance(&mut p, &direction, &residual, (down / curvature) as f32, total);
    }
    Some(Pressed { pressure: p, push })
}

/// A step along `direction`; cells that would pull let go, cells that overlap join. 1 if the touching cells stay the same
/// and the next direction may be conjugate to this one, else 0.
fn advance(p: &mut [f32], direction: &[f32], residual: &[f32], step: f32, total: f32) -> f32 {
    let (mut keep, mut sum) = (1.0, 0.0_f64);
    for c in 0..p.len() {
        if p[c] > 0.0 {
            p[c] += step * direction[c];
            if p[c] <= 0.0 {
                (p[c], keep) = (0.0, 0.0);
            }
        } else if residual[c] < 0.0 {
            (p[c], keep) = (-step * residual[c], 0.0);
        }
        sum += f64::from(p[c]);
    }
    let scale = total / sum as f32;
    p.iter_mut().for_each(|p| *p *= scale);
    keep
}

/// Mean over the touching cells.
fn mean(p: &[f32], values: impl Iterator<Item = f32>) -> f32 {
    let (mut sum, mut count) = (0.0_f64, 0.0_f64);
    for (&p, value) in p.iter().zip(values) {
        if p > 0.0 {
            sum += f64::from(value);
            count += 1.0;
        }
    }
    (sum / count) as f32
}

/// Surface displacement (into the gel and the body) by a pressure, m.
fn convolve(gel: &Gel, pressure: &[f32], out: &mut [f32], scratch: &mut Scratch) {
    let Scratch { spectra, buffers: Some(buffers), composite, .. } = scratch else { return };
    let spectrum = &mut spectra[0];
    gel.plane.forward(pressure, spectrum, buffers);
    for (value, kernel) in spectrum.iter_mut().zip(composite.iter()) {
        *value *= *kernel;
    }
    gel.plane.inverse(spectrum, out, buffers);
}

/// Compliance of waves a few thicknesses long, m/Pa: that of a bed of springs to start from.
fn long_wave(gel: &Gel, scratch: &Scratch) -> f32 {
    let size = (gel.plane.wide * gel.plane.high) as f32;
    let wave = (1.0 / gel.pad.thickness) as f32;
    let run = gel.kernels.k.iter().step_by(gel.plane.high).position(|&k| k >= wave).unwrap_or(1);
    scratch.composite[run * gel.plane.high] * size
}

/// Pressure of a bed of springs of `stiffness` (Pa/m) pressed to the same sum.
fn foundation(gap: &[f32], total: f32, stiffness: f32) -> Option<Vec<f32>> {
    let least = gap.iter().copied().filter(|g| g.is_finite()).fold(f32::INFINITY, f32::min);
    if !least.is_finite() {
        return None;
    }
    let sum = |depth: f32| gap.iter().map(|&g| f64::from((depth - g).max(0.0) * stiffness)).sum::<f64>();
    let mut high = 1e-5_f32;
    while sum(least + high) < f64::from(total) && high < 1.0 {
        high *= 2.0;
    }
    let mut low = 0.5 * high;
    for _ in 0..8 {
        let middle = 0.5 * (low + high);
        *(if sum(least + middle) < f64::from(total) { &mut low } else { &mut high }) = middle;
    }
    let scale = (f64::from(total) / sum(least + high)) as f32;
    Some(gap.iter().map(|&g| scale * stiffness * (least + high - g).max(0.0)).collect())
}
