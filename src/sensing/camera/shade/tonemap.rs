//! From scene radiance to bytes.

use crate::sensing::camera::simd::{F8, V8, whole};

/// The Khronos PBR Neutral tone mapper (Khronos Group, 2024): leaves colours below 0.76 nearly as they are and rolls
/// highlights off towards white. Linear RGB to linear RGB in 0..1.
#[inline(always)]
fn neutral(colour: V8) -> V8 {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let one = F8::ONE;
    let least = colour.x.fast_min(colour.y).fast_min(colour.z);
    let toe = least - F8::splat(6.25) * least * least;
    let offset = least.simd_lt(F8::splat(0.08)).select(toe, F8::splat(0.04));
    let colour = colour.map(|c| c - offset);
    let peak = colour.x.fast_max(colour.y).fast_max(colour.z);
    let bright = peak.simd_ge(F8::splat(START));
    if !bright.any() {
        return colour;
    }
    let room = 1.0 - START;
    let rolled = one - F8::splat(room * room) / (peak + F8::splat(room - START)).fast_max(F8::splat(room));
    let kept = one / (F8::splat(DESATURATION) * (peak - rolled) + one);
    let scale = rolled / peak.fast_max(F8::splat(1e-6)) * kept;
    let grey = rolled * (one - kept);
    colour.map(|c| c * scale + grey).or(bright, colour)
}

/// Entries of the table of sRGB's curve: a step of it is less than a fifth of a byte's.
const ENTRIES: usize = 2048;

/// The power 5/6 of a number in 0.01..=1 by Newton's method from above: the same bits on every machine.
fn five_sixths(x: f64) -> f64 {
    let target = x.powi(5);
    (0..40).fold(1.0, |y: f64, _| y - (y - target / y.powi(5)) / 6.0)
}

/// Radiance to display values: exposure, tone curve, sRGB (IEC 61966-2-1).
#[derive(Clone, Debug)]
pub(crate) struct ToneMapper {
    exposure: f32,
    /// TileDisplay value, 0..=255, at `i / (ENTRIES − 1)` of the square root of the linear value.
    curve: Box<[f32; ENTRIES]>,
}

impl ToneMapper {
    pub(crate) fn new(exposure: f64) -> Self {
        let mut curve = Box::new([0.0; ENTRIES]);
        for (i, value) in curve.iter_mut().enumerate() {
            let root = i as f64 / (ENTRIES - 1) as f64;
            let x = root * root;
            let display = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * five_sixths(root) - 0.055 };
            *value = (255.0 * display) as f32;
        }
        Self { exposure: exposure as f32, curve }
    }

    /// TileDisplay values, 0..=255, not yet rounded.
    #[inline(always)]
    pub(crate) fn display(&self, radiance: V8) -> V8 {
        let scale = F8::splat((ENTRIES - 1) as f32);
        neutral(radiance * F8::splat(self.exposure)).map(|c| {
            let at = whole(c.fast_max(F8::ZERO).fast_min(F8::ONE).sqrt() * scale + F8::splat(0.5));
            F8::new(at.map(|i| self.curve[i as usize % ENTRIES]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_srgbs() {
        for x in [0.0032_f64, 0.02, 0.18, 0.5, 0.9, 1.0] {
            assert!((five_sixths(x.sqrt()) - x.powf(1.0 / 2.4)).abs() < 1e-14, "{x}");
        }
        // Neutral leaves middle colours alone but for 0.04.
        let display =
            ToneMapper::new(1.0).display(V8 { x: F8::splat(0.254), y: F8::splat(0.2), z: F8::splat(0.14) });
        let expected = 255.0 * (1.055 * 0.214_f64.powf(1.0 / 2.4) - 0.055);
        assert!((f64::from(display.x.to_array()[0]) - expected).abs() < 0.15);
    }
}
