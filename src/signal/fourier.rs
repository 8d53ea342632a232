//! Convolution on a grid that is zero outside: real two-dimensional Fourier transforms with padding.

use std::{ops::Range, sync::Arc};

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

pub use rustfft::num_complex::Complex32;

/// Transforms of fields of `columns` × `rows` cells, padded to `width` × `height`.
///
/// A spectrum is stored by x frequency: `half_width` = width/2 + 1 blocks of `height` numbers, one per y frequency.
pub struct PaddedFft {
    columns: usize,
    rows: usize,
    /// Cells of a padded row.
    pub width: usize,
    /// Padded rows.
    pub height: usize,
    /// Non-negative x frequencies.
    pub half_width: usize,
    forward_x: Arc<dyn RealToComplex<f32>>,
    inverse_x: Arc<dyn ComplexToReal<f32>>,
    forward_y: Arc<dyn Fft<f32>>,
    inverse_y: Arc<dyn Fft<f32>>,
}

/// Intermediate results of a transform.
#[derive(Clone, Debug, Default)]
pub struct FftBuffers {
    row: Vec<f32>,
    row_spectrum: Vec<Complex32>,
    scratch: Vec<Complex32>,
}

/// Least multiple of 4 of at least `n` without prime factors above 5; FFTs of these lengths are fast.
fn fast_length(n: usize) -> usize {
    let is_smooth = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    (n..).find(|&n| n % 4 == 0 && is_smooth(n)).unwrap_or(n)
}

impl PaddedFft {
    /// Transforms whose periodic images of the field are at least `margin` cells apart.
    pub fn new(columns: usize, rows: usize, margin: usize) -> Self {
        let (width, height) = (fast_length(columns + margin), fast_length(rows + margin));
        let (mut real, mut complex) = (RealFftPlanner::new(), FftPlanner::new());
        Self {
            columns,
            rows,
            width,
            height,
            half_width: width / 2 + 1,
            forward_x: real.plan_fft_forward(width),
            inverse_x: real.plan_fft_inverse(width),
            forward_y: complex.plan_fft_forward(height),
            inverse_y: complex.plan_fft_inverse(height),
        }
    }

    /// Buffers for [`forward`](Self::forward) and [`inverse`](Self::inverse).
    pub fn buffers(&self) -> FftBuffers {
        let lengths = [
            self.forward_x.get_scratch_len(),
            self.inverse_x.get_scratch_len(),
            self.forward_y.get_inplace_scratch_len(),
            self.inverse_y.get_inplace_scratch_len(),
        ];
        FftBuffers {
            row: vec![0.0; self.width],
            row_spectrum: vec![Complex32::default(); self.half_width],
            scratch: vec![Complex32::default(); lengths.into_iter().max().unwrap_or(0)],
        }
    }

    /// A spectrum of zeros.
    pub fn spectrum(&self) -> Vec<Complex32> {
        vec![Complex32::default(); self.half_width * self.height]
    }

    /// Wave vector (1/m) of the entry at index `ix` along x and `iy` along y, for cells of edge `cell` (m).
    pub fn wave_vector(&self, ix: usize, iy: usize, cell: f64) -> [f64; 2] {
        let step = |n: usize| std::f64::consts::TAU / (n as f64 * cell);
        let signed = if iy > self.height / 2 { iy as f64 - self.height as f64 } else { iy as f64 };
        [ix as f64 * step(self.width), signed * step(self.height)]
    }

    /// Writes the spectrum of `field`. Rows of zeros cost nothing.
    pub fn forward(&self, field: &[f32], spectrum: &mut [Complex32], buffers: &mut FftBuffers) {
        let FftBuffers { row: padded, row_spectrum, scratch } = buffers;
        spectrum.fill(Complex32::default());
        for (j, row) in field.chunks_exact(self.columns).enumerate() {
            if row.iter().all(|&value| value == 0.0) {
                continue;
            }
            padded[..self.columns].copy_from_slice(row);
            padded[self.columns..].fill(0.0);
            // This fails only for lengths other than those of the plan.
            let _ = self.forward_x.process_with_scratch(padded, row_spectrum, scratch);
            for (i, value) in row_spectrum.iter().enumerate() {
                spectrum[i * self.height + j] = *value;
            }
        }
        self.forward_y.process_with_scratch(spectrum, scratch);
    }

    /// Writes the field of a spectrum, scaled by `width · height`. The spectrum is overwritten.
    pub fn inverse(&self, spectrum: &mut [Complex32], field: &mut [f32], buffers: &mut FftBuffers) {
        self.inverse_rows(spectrum, field, 0..self.rows, buffers);
    }

    /// As [`inverse`](Self::inverse), but writes some rows of the field alone.
    pub fn inverse_rows(
        &self,
        spectrum: &mut [Complex32],
        field: &mut [f32],
        rows: Range<usize>,
        buffers: &mut FftBuffers,
    ) {
        let FftBuffers { row: padded, row_spectrum, scratch } = buffers;
        self.inverse_y.process_with_scratch(spectrum, scratch);
        for (j, row) in field.chunks_exact_mut(self.columns).enumerate().take(rows.end).skip(rows.start) {
            for (i, value) in row_spectrum.iter_mut().enumerate() {
                *value = spectrum[i * self.height + j];
            }
            row_spectrum[0].im = 0.0;
            row_spectrum[self.half_width - 1].im = 0.0;
            let _ = self.inverse_x.process_with_scratch(row_spectrum, padded, scratch);
            row.copy_from_slice(&padded[..self.columns]);
        }
    }
}

impl std::fmt::Debug for PaddedFft {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "PaddedFft({} × {} in {} × {})", self.columns, self.rows, self.width, self.height)
    }
}
