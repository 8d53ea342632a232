//! Convolution on a grid that is zero outside: real two-dimensional Fourier transforms with padding.

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner, num_complex::Complex32};

/// The transforms of fields of `columns` × `rows`, padded to `wide` × `high`.
///
/// A spectrum holds `half` = wide/2 + 1 runs of `high` numbers: the frequency along x is the run.
pub(super) struct Plane {
    pub columns: usize,
    pub rows: usize,
    pub wide: usize,
    pub high: usize,
    pub half: usize,
    along: Arc<dyn RealToComplex<f32>>,
    along_back: Arc<dyn ComplexToReal<f32>>,
    across: Arc<dyn Fft<f32>>,
    across_back: Arc<dyn Fft<f32>>,
}

/// What a transform writes on the way.
#[derive(Clone, Debug)]
pub(super) struct Buffers {
    line: Vec<f32>,
    half_line: Vec<Complex32>,
    scratch: Vec<Complex32>,
}

/// The least multiple of 4 of at least `n` without prime factors above 5: the fast ones.
fn fast_length(n: usize) -> usize {
    let smooth = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    (n..).find(|&n| n % 4 == 0 && smooth(n)).unwrap_or(n)
}

impl Plane {
    /// A plane in which images of the field are at least `margin` cells apart.
    pub(super) fn new(columns: usize, rows: usize, margin: usize) -> Self {
        let (wide, high) = (fast_length(columns + margin), fast_length(rows + margin));
        let (mut real, mut complex) = (RealFftPlanner::new(), FftPlanner::new());
        Self {
            columns,
            rows,
            wide,
            high,
            half: wide / 2 + 1,
            along: real.plan_fft_forward(wide),
            along_back: real.plan_fft_inverse(wide),
            across: complex.plan_fft_forward(high),
            across_back: complex.plan_fft_inverse(high),
        }
    }

    pub(super) fn buffers(&self) -> Buffers {
        let lengths = [
            self.along.get_scratch_len(),
            self.along_back.get_scratch_len(),
            self.across.get_inplace_scratch_len(),
            self.across_back.get_inplace_scratch_len(),
        ];
        Buffers {
            line: vec![0.0; self.wide],
            half_line: vec![Complex32::default(); self.half],
            scratch: vec![Complex32::default(); lengths.into_iter().max().unwrap_or(0)],
        }
    }

    pub(super) fn spectrum(&self) -> Vec<Complex32> {
        vec![Complex32::default(); self.half * self.high]
    }

    /// Angular frequencies of entry (`run`, `at`) along x and y, 1/m, for cells of edge `cell`; the highest, whose
    /// sign is not defined, as 0 in the second pair, which odd kernels use.
    pub(super) fn frequency(&self, run: usize, at: usize, cell: f64) -> ([f64; 2], [f64; 2]) {
        let step = |n: usize| std::f64::consts::TAU / (n as f64 * cell);
        let signed = if at > self.high / 2 { at as f64 - self.high as f64 } else { at as f64 };
        let k = [run as f64 * step(self.wide), signed * step(self.high)];
        let odd =
            [if 2 * run == self.wide { 0.0 } else { k[0] }, if 2 * at == self.high { 0.0 } else { k[1] }];
        (k, odd)
    }

    /// The spectrum of `field`; rows of zeros cost nothing.
    pub(super) fn forward(&self, field: &[f32], spectrum: &mut [Complex32], buffers: &mut Buffers) {
        let Buffers { line, half_line, scratch } = buffers;
        spectrum.fill(Complex32::default());
        for (j, row) in field.chunks_exact(self.columns).enumerate() {
            if row.iter().all(|&value| value == 0.0) {
                continue;
            }
            line[..self.columns].copy_from_slice(row);
            line[self.columns..].fill(0.0);
            // The lengths are those of the plan: this cannot fail.
            let _ = self.along.process_with_scratch(line, half_line, scratch);
            for (i, value) in half_line.iter().enumerate() {
                spectrum[i * self.high + j] = *value;
            }
        }
        self.across.process_with_scratch(spectrum, scratch);
    }

    /// The field of a spectrum, times `wide · high`; the spectrum is spent.
    pub(super) fn inverse(&self, spectrum: &mut [Complex32], field: &mut [f32], buffers: &mut Buffers) {
        let Buffers { line, half_line, scratch } = buffers;
        self.across_back.process_with_scratch(spectrum, scratch);
        for (j, row) in field.chunks_exact_mut(self.columns).enumerate() {
            for (i, value) in half_line.iter_mut().enumerate() {
                *value = spectrum[i * self.high + j];
            }
            half_line[0].im = 0.0;
            half_line[self.half - 1].im = 0.0;
            let _ = self.along_back.process_with_scratch(half_line, line, scratch);
            row.copy_from_slice(&line[..self.columns]);
        }
    }
}

impl std::fmt::Debug for Plane {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Plane({} × {} in {} × {})", self.columns, self.rows, self.wide, self.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_the_same_field() {
        let plane = Plane::new(10, 7, 5);
        assert_eq!((plane.wide, plane.high), (16, 12));
        let field: Vec<f32> = (0..70).map(|i| (i as f32 * 0.7).sin()).collect();
        let (mut spectrum, mut buffers) = (plane.spectrum(), plane.buffers());
        plane.forward(&field, &mut spectrum, &mut buffers);
        let mut back = vec![0.0; 70];
        plane.inverse(&mut spectrum, &mut back, &mut buffers);
        for (a, b) in field.iter().zip(&back) {
            assert!((a - b / (16.0 * 12.0)).abs() < 1e-6);
        }
    }
}
