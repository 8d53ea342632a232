//! From scene radiance to bytes.

use super::V3;

/// The Khronos PBR Neutral tone mapper (Khronos Group, 2024): leaves colours below 0.76 nearly as they are and rolls
/// highlights off towards white. Linear RGB to linear RGB in 0..1.
fn neutral(mut colour: V3) -> V3 {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let least = colour.min();
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    colour.add_scalar_mut(-offset);
    let peak = colour.max();
    if peak < START {
        return colour;
    }
    let room = 1.0 - START;
    let rolled = 1.0 - room * room / (peak + room - START);
    colour *= rolled / peak;
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - rolled) + 1.0);
    colour * (1.0 - grey) + V3::repeat(rolled) * grey
}

/// Entries of the table of sRGB's curve.
const ENTRIES: usize = 4096;

/// Radiance to display values: exposure, tone curve, sRGB (IEC 61966-2-1).
#[derive(Clone, Debug)]
pub(super) struct Tone {
    exposure: f32,
    /// Display value, 0..=255, at `i / (ENTRIES − 2)` of the square root of the linear value.
    curve: Vec<f32>,
}

impl Tone {
    pub fn new(exposure: f64) -> Self {
        let encode = |root: f64| {
            let x = root * root;
            let display = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            (255.0 * display) as f32
        };
        let curve = (0..ENTRIES).map(|i| encode((i as f64 / (ENTRIES - 2) as f64).min(1.0))).collect();
        Self { exposure: exposure as f32, curve }
    }

    /// Display values, 0..=255, not yet rounded.
    pub fn display(&self, radiance: &V3) -> V3 {
        neutral(radiance * self.exposure).map(|x| {
            let at = x.clamp(0.0, 1.0).sqrt() * (ENTRIES - 2) as f32;
            let i = at as usize;
            self.curve[i] + (self.curve[i + 1] - self.curve[i]) * (at - i as f32)
        })
    }
}

/// The nearest byte.
pub(super) fn byte(display: f32) -> u8 {
    (display + 0.5) as u8
}
