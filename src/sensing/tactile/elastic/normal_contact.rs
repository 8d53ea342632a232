//! Pressure under a pressed shape: conjugate gradients on the touching cells (Polonsky & Keer, Wear 231 (1999) 206),
//! with the total force given and the indentation found.

use super::gel::{Gel, GelScratch};

/// Iterations end when the gap of the touching cells is below this share of the deepest indentation (RMS).
const TOLERANCE: f64 = 2e-3;
/// Largest number of iterations; a sphere takes 6, ridges 15.
const MAX_ITERATIONS: usize = 60;

/// Solution of a normal contact.
#[derive(Clone, Debug)]
pub(super) struct NormalSolution {
    /// Pressure on the gel, Pa.
    pub(super) pressure: Vec<f32>,
    /// Rigid approach of the shape from its given position, m; negative if it was pulled back.
    pub(super) approach: f64,
}

/// Presses a shape into the gel until the pressure sums up to `force` (N).
///
/// `gap` is the height of the shape above the undeformed gel at each cell, m; infinite where there is no shape.
/// `None` if there is no shape at all.
pub(super) fn solve_normal_contact(
    gel: &Gel,
    gap: &[f32],
    force: f64,
    scratch: &mut GelScratch,
) -> Option<NormalSolution> {
    let area = gel.cell * gel.cell;
    let total = (force / area) as f32;
    let mut p = winkler_pressure(gap, total, 1.0 / foundation_compliance(gel, scratch))?;
    let n = gap.len();
    let (mut residual, mut direction, mut moved) = (vec![0.0_f32; n], vec![0.0_f32; n], vec![0.0_f32; n]);
    let mut sunk = vec![0.0_f32; n];
    apply_compliance(gel, &p, &mut sunk, scratch);
    let mut touching = touching_cells(&p);
    // `conjugate` is 1 if the next direction may be conjugate to the last one, and 0 if the
    // touching cells have changed.
    let (mut before, mut conjugate, mut approach) = (1.0_f64, 0.0_f32, 0.0);
    for _ in 0..MAX_ITERATIONS {
        let depth = mean_over(&touching, |c| sunk[c] + gap[c]);
        approach = f64::from(depth);
        let mut now = 0.0_f64;
        let mut deepest = 0.0_f32;
        for &c in &touching {
            residual[c] = sunk[c] + gap[c] - depth;
            deepest = deepest.max(sunk[c]);
            now += f64::from(residual[c] * residual[c]);
        }
        if (now / touching.len() as f64).sqrt() < TOLERANCE * f64::from(deepest) {
            break;
        }
        let share = conjugate * (now / before) as f32;
        touching.iter().for_each(|&c| direction[c] = share * direction[c] - residual[c]);
        before = now;
        apply_compliance(gel, &direction, &mut moved, scratch);
        let level = mean_over(&touching, |c| moved[c]);
        let (mut descent, mut curvature) = (0.0_f64, 0.0_f64);
        for &c in &touching {
            descent -= f64::from(residual[c] * direction[c]);
            curvature += f64::from((moved[c] - level) * direction[c]);
        }
        if curvature <= 0.0 || curvature.is_nan() {
            break;
        }
        let step = (descent / curvature) as f32;
        // Cells that would pull lose contact, cells that overlap gain it.
        let overlap = |c: usize| depth - (sunk[c] + gap[c]);
        let gained: Vec<usize> = (0..n).filter(|&c| p[c] <= 0.0 && overlap(c) > 0.0).collect();
        let mut is_same_contact = gained.is_empty();
        for &c in &touching {
            p[c] += step * direction[c];
            if p[c] <= 0.0 {
                (p[c], direction[c], is_same_contact) = (0.0, 0.0, false);
            }
        }
        gained.iter().for_each(|&c| p[c] = step * overlap(c));
        if !is_same_contact {
            touching = touching_cells(&p);
        }
        let scale = total / touching.iter().map(|&c| f64::from(p[c])).sum::<f64>() as f32;
        touching.iter().for_each(|&c| p[c] *= scale);
        if is_same_contact {
            conjugate = 1.0;
            sunk.iter_mut().zip(&moved).for_each(|(u, m)| *u = scale * (*u + step * m));
        } else {
            conjugate = 0.0;
            apply_compliance(gel, &p, &mut sunk, scratch);
        }
    }
    Some(NormalSolution { pressure: p, approach })
}

/// The cells with pressure.
fn touching_cells(p: &[f32]) -> Vec<usize> {
    (0..p.len()).filter(|&c| p[c] > 0.0).collect()
}

/// Mean of a value over some cells.
fn mean_over(cells: &[usize], value: impl Fn(usize) -> f32) -> f32 {
    let sum: f64 = cells.iter().map(|&c| f64::from(value(c))).sum();
    (sum / cells.len() as f64) as f32
}

/// Writes the displacement of the surface (into gel and body together) by a pressure, m.
fn apply_compliance(gel: &Gel, pressure: &[f32], out: &mut [f32], scratch: &mut GelScratch) {
    let GelScratch { spectra, buffers, compliance, .. } = scratch;
    let spectrum = &mut spectra[0];
    gel.fft.forward(pressure, spectrum, buffers);
    for (value, kernel) in spectrum.iter_mut().zip(compliance.iter()) {
        *value *= *kernel;
    }
    gel.fft.inverse(spectrum, out, buffers);
}

/// Compliance of waves a few thicknesses long, m/Pa, for the Winkler foundation of the first guess.
fn foundation_compliance(gel: &Gel, scratch: &GelScratch) -> f32 {
    let size = (gel.fft.width * gel.fft.height) as f32;
    let wave = (1.0 / gel.pad.thickness) as f32;
    let ix = gel.kernels.k.iter().step_by(gel.fft.height).position(|&k| k >= wave).unwrap_or(1);
    scratch.compliance[ix * gel.fft.height] * size
}

/// Pressure of a Winkler foundation (independent springs) of `stiffness` (Pa/m), pressed to the sum `total`.
fn winkler_pressure(gap: &[f32], total: f32, stiffness: f32) -> Option<Vec<f32>> {
    let least = gap.iter().copied().filter(|g| g.is_finite()).fold(f32::INFINITY, f32::min);
    if !least.is_finite() {
        return None;
    }
    // Eight interleaved sums, which the compiler vectorises.
    let sum = |depth: f32| {
        let mut sums = [0.0_f64; 8];
        let force = |g: f32| f64::from((depth - g).max(0.0) * stiffness);
        let (eights, rest) = gap.as_chunks::<8>();
        eights.iter().for_each(|some| sums.iter_mut().zip(some).for_each(|(sum, g)| *sum += force(*g)));
        sums.into_iter().chain(rest.iter().map(|g| force(*g))).sum::<f64>()
    };
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
