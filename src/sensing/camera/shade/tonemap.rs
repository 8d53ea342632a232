//! Conversion of scene radiance to display values: exposure, tone curve and sRGB encoding.

use crate::camera::math::{Vec3x8, f32x8, floor_to_u32};

/// The Khronos PBR Neutral tone mapper (Khronos Group, 2024), linear RGB to linear RGB in 0..1.
///
/// It keeps colours below 0.76 nearly unchanged, so that albedos appear as specified, and
/// compresses highlights to white.
#[inline(always)]
fn khronos_neutral(colour: Vec3x8) -> Vec3x8 {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let one = f32x8::ONE;
    let min = colour.x.fast_min(colour.y).fast_min(colour.z);
    let toe = min - f32x8::splat(6.25) * min * min;
    let offset = min.simd_lt(f32x8::splat(0.08)).select(toe, f32x8::splat(0.04));
    let colour = colour.map(|c| c - offset);
    let peak = colour.x.fast_max(colour.y).fast_max(colour.z);
    let is_bright = peak.simd_ge(f32x8::splat(START));
    if !is_bright.any() {
        return colour;
    }
    let headroom = 1.0 - START;
    let compressed_peak = one
        - f32x8::splat(headroom * headroom)
            / (peak + f32x8::splat(headroom - START)).fast_max(f32x8::splat(headroom));
    let saturation = one / (f32x8::splat(DESATURATION) * (peak - compressed_peak) + one);
    let scale = compressed_peak / peak.fast_max(f32x8::splat(1e-6)) * saturation;
    let grey = compressed_peak * (one - saturation);
    Vec3x8::select(is_bright, colour.map(|c| c * scale + grey), colour)
}

/// Entries of the table of the sRGB curve: its steps are less than a fifth of a byte.
const TABLE_LEN: usize = 2048;

/// Returns x^(5/6) for x in 0.01..=1 by Newton's method. Unlike `powf`, it gives the same bits on every machine.
fn pow_five_sixths(x: f64) -> f64 {
    let target = x.powi(5);
    (0..40).fold(1.0, |y: f64, _| y - (y - target / y.powi(5)) / 6.0)
}

/// Maps radiance to sRGB display values (IEC 61966-2-1).
#[derive(Clone, Debug)]
pub(crate) struct ToneMapper {
    exposure: f32,
    /// Display value, 0..=255, where the square root of the linear value is `i / (TABLE_LEN − 1)`.
    table: Box<[f32; TABLE_LEN]>,
}

impl ToneMapper {
    pub(crate) fn new(exposure: f64) -> Self {
        let mut table = Box::new([0.0; TABLE_LEN]);
        for (i, value) in table.iter_mut().enumerate() {
            let root = i as f64 / (TABLE_LEN - 1) as f64;
            let x = root * root;
            let display = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * pow_five_sixths(root) - 0.055 };
            *value = (255.0 * display) as f32;
        }
        Self { exposure: exposure as f32, table }
    }

    /// Returns display values, 0..=255, not yet rounded to bytes.
    #[inline(always)]
    pub(crate) fn display(&self, radiance: Vec3x8) -> Vec3x8 {
        let scale = f32x8::splat((TABLE_LEN - 1) as f32);
        khronos_neutral(radiance * f32x8::splat(self.exposure)).map(|c| {
            let clamped = c.fast_max(f32x8::ZERO).fast_min(f32x8::ONE);
            let index = floor_to_u32(clamped.sqrt() * scale + f32x8::splat(0.5));
            f32x8::new(index.map(|i| self.table[i as usize % TABLE_LEN]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_encoding_curve_is_that_of_srgb() {
        for x in [0.0032_f64, 0.02, 0.18, 0.5, 0.9, 1.0] {
            assert!((pow_five_sixths(x.sqrt()) - x.powf(1.0 / 2.4)).abs() < 1e-14, "{x}");
        }
        // The Neutral curve only subtracts 0.04 from mid-tones.
        let display = ToneMapper::new(1.0).display(Vec3x8 {
            x: f32x8::splat(0.254),
            y: f32x8::splat(0.2),
            z: f32x8::splat(0.14),
        });
        let expected = 255.0 * (1.055 * 0.214_f64.powf(1.0 / 2.4) - 0.055);
        assert!((f64::from(display.x.to_array()[0]) - expected).abs() < 0.15);
    }
}
