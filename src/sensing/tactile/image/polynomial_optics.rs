//! Polynomial optics: a smooth function of the surface's slope, fitted to a real GelSight Mini.

use std::ops::Range;

use image::{Rgb, RgbImage};
use serde::{Deserialize, Serialize};
use wide::{f32x8, i16x8, u8x16};

use super::{
    super::elastic::{Gel, GelField},
    shadow::{Led, ShadowCaster},
    visible_surface::{MIN_SLOPE, VisibleSurface},
};
use softvt_robot::tactile::IMAGE_SIZE;

/// Coefficients of the GelSight Mini, written by `examples/fit_gelsight.rs`.
const GELSIGHT_MINI: &str = include_str!("../../../../assets/gelsight/mini.json");

/// Number of monomials of the slope, of degree 1 to 5. There is no constant term, so a flat surface changes no colour.
pub const SLOPE_MONOMIALS: usize = 20;
const MAX_DEGREE: i32 = 5;

/// Fitted coefficients of a sensor, as in `assets/gelsight/mini.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpticsFile {
    /// Data of the fit: name, licence, source, date.
    pub source: String,
    /// Assumptions of the fit.
    pub note: String,
    /// Radius of the calibration ball, mm.
    pub ball_radius_mm: f64,
    /// Mean absolute error in the contact circles of images left out of the fit, grey levels of 255.
    pub held_out_l1: f64,
    /// Greatest sine of slope in the fit; steeper surfaces are coloured like this one.
    pub steepest: f64,
    /// Cosine series of the untouched image by channel: the sum of `background[c][j][i]` · cos(π i u) cos(π j v),
    /// grey levels, with (u, v) from 0 to 1 across the image.
    pub background: [Vec<Vec<f64>>; 3],
    /// Relative change of the light by channel and monomial of the slope; see [`slope_monomials`].
    pub colour: [Vec<f64>; 3],
}

/// Optics of a sensor as a polynomial of the surface's slope.
///
/// A slope multiplies the light that falls on its pixel, which the untouched image shows (Lambert's law for
/// a light source of one elevation). So the same slope has the same sign of change everywhere, and a flat
/// surface changes nothing. The factor of each channel is 1 plus a polynomial of degree 5 in the sines of
/// the slope; see [`slope_monomials`].
#[derive(Clone, Debug)]
pub struct PolynomialOptics {
    /// Image without a contact, 320 × 240.
    pub(super) untouched: RgbImage,
    /// The same by channel, before rounding to grey levels.
    background: [Vec<f32>; 3],
    steepest: f32,
    colour: [[f32; SLOPE_MONOMIALS]; 3],
    /// LEDs of the red, green and blue channel, as the fit implies them.
    pub(super) leds: [Led; 3],
}

/// Reasons why coefficients cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages describe the variants")]
pub enum OpticsError {
    #[error("optics: {0}")]
    Format(String),
    #[error("optics: {field} has {found} entries per channel, expected {expected}")]
    Count { field: &'static str, found: usize, expected: usize },
}

/// Monomials aⁱ bʲ, 1 ≤ i + j ≤ 5, of the sines (a, b) of the slope along x and y: by degree, then by increasing i.
pub fn slope_monomials(a: f64, b: f64) -> [f64; SLOPE_MONOMIALS] {
    let mut out = [0.0; SLOPE_MONOMIALS];
    let powers = (1..=MAX_DEGREE).flat_map(|degree| (0..=degree).map(move |i| (i, degree - i)));
    out.iter_mut().zip(powers).for_each(|(out, (i, j))| *out = a.powi(i) * b.powi(j));
    out
}

impl PolynomialOptics {
    /// Optics of the GelSight Mini.
    ///
    /// # Errors
    /// The coefficients in the binary are invalid, which a test excludes.
    pub fn gelsight_mini() -> Result<Self, OpticsError> {
        Self::parse(GELSIGHT_MINI)
    }

    /// Optics of the coefficients in JSON ([`OpticsFile`]).
    ///
    /// # Errors
    /// The text is not such JSON, or a list of coefficients has another length than it must have.
    pub fn parse(text: &str) -> Result<Self, OpticsError> {
        let file: OpticsFile = serde_json::from_str(text).map_err(|e| OpticsError::Format(e.to_string()))?;
        let mut colour = [[0.0; SLOPE_MONOMIALS]; 3];
        for (to, from) in colour.iter_mut().zip(&file.colour) {
            let (found, expected) = (from.len(), SLOPE_MONOMIALS);
            let from = <&[f64; SLOPE_MONOMIALS]>::try_from(&from[..]);
            *to =
                from.map_err(|_| OpticsError::Count { field: "colour", found, expected })?.map(|c| c as f32);
        }
        let background = cosine_series(&file.background);
        Ok(Self {
            untouched: RgbImage::from_fn(IMAGE_SIZE[0] as u32, IMAGE_SIZE[1] as u32, |x, y| {
                let at = y as usize * IMAGE_SIZE[0] + x as usize;
                Rgb(background.each_ref().map(|levels| grey_level(levels[at])))
            }),
            background,
            steepest: file.steepest as f32,
            leds: colour.map(|c| Led::from_linear_fit(c[1], c[0])),
            colour,
        })
    }

    /// Image of a field, 320 × 240, with cast shadows if `shadows`. Without a field the image is the untouched one
    /// exactly, as is every pixel without a slope.
    pub fn render(&self, gel: &Gel, field: Option<&GelField>, shadows: bool) -> RgbImage {
        let mut image = self.untouched.clone();
        let Some(field) = field else { return image };
        let surface = VisibleSurface::new(gel, field);
        let pitch = gel.view.pitch as f32;
        let shadow_caster = shadows.then(|| ShadowCaster::new(&surface, pitch));
        let [width, height] = surface.size;
        let mut line = LightRow::new(width);
        for row in 0..height {
            surface.slopes(row, pitch, &mut line.a, &mut line.b);
            let steep = line.slopes_to_sines(self.steepest);
            // A shadow may fall on flat ground.
            let Some(range) = shadow_caster.as_ref().map(|_| 0..width).or(steep) else { continue };
            for (channel, colour) in self.colour.iter().enumerate() {
                line.compute_light(channel, colour, range.clone());
                if let Some(shadow_caster) = &shadow_caster {
                    let light = &mut line.light[channel][range.clone()];
                    shadow_caster.cast(&self.leds[channel], row, range.start, light);
                }
            }
            let at = (surface.from[1] + row) * IMAGE_SIZE[0] + surface.from[0];
            let (from, to) = (at + range.start, at + range.end);
            for (channel, background) in self.background.iter().enumerate() {
                line.colour(channel, &background[from..to], range.clone());
            }
            let [red, green, blue] = line.levels.each_ref().map(|levels| &levels[range.clone()]);
            let pixels = (*image)[3 * from..3 * to].as_chunks_mut::<3>().0;
            for (out, ((r, g), b)) in pixels.iter_mut().zip(red.iter().zip(green).zip(blue)) {
                *out = [*r, *g, *b];
            }
        }
        image
    }
}

/// Slopes and light of one row of pixels.
struct LightRow {
    /// Sines of the slope along x and y.
    a: Vec<f32>,
    b: Vec<f32>,
    /// Light relative to the untouched image, by channel.
    light: [Vec<f32>; 3],
    /// Grey levels by channel.
    levels: [Vec<u8>; 3],
}

impl LightRow {
    fn new(width: usize) -> Self {
        Self {
            a: vec![0.0; width],
            b: vec![0.0; width],
            light: std::array::from_fn(|_| vec![0.0; width]),
            levels: std::array::from_fn(|_| vec![0; width]),
        }
    }

    /// Replaces slopes by their sines, limited to `steepest`. Returns the range from the first to the last
    /// pixel with a slope.
    fn slopes_to_sines(&mut self, steepest: f32) -> Option<Range<usize>> {
        let steepest2 = steepest * steepest;
        for (a, b) in self.a.iter_mut().zip(&mut self.b) {
            let square = *a * *a + *b * *b;
            let is_limited = square > steepest2 * (1.0 + square);
            let (above, below) = if is_limited { (steepest2, square) } else { (1.0, 1.0 + square) };
            let scale = (above / below).sqrt();
            (*a, *b) = (*a * scale, *b * scale);
        }
        let steep = |(a, b): (&f32, &f32)| a.abs().max(b.abs()) > MIN_SLOPE;
        let first = self.a.iter().zip(&self.b).position(steep)?;
        let end = self.a.iter().zip(&self.b).rposition(steep)? + 1;
        Some(first..end)
    }

    /// Computes the light of one channel in a range of the row.
    fn compute_light(&mut self, channel: usize, c: &[f32; SLOPE_MONOMIALS], range: Range<usize>) {
        let out = &mut self.light[channel][range.clone()];
        let slopes = self.a[range.clone()].iter().zip(&self.b[range]);
        for ((&a, &b), light) in slopes.zip(out) {
            // By powers of a, Horner's rule in b within each.
            let a0 = b * (c[0] + b * (c[2] + b * (c[5] + b * (c[9] + b * c[14]))));
            let a1 = c[1] + b * (c[3] + b * (c[6] + b * (c[10] + b * c[15])));
            let a2 = c[4] + b * (c[7] + b * (c[11] + b * c[16]));
            let a3 = c[8] + b * (c[12] + b * c[17]);
            let a4 = c[13] + b * c[18];
            *light = 1.0 + a0 + a * (a1 + a * (a2 + a * (a3 + a * (a4 + a * c[19]))));
        }
    }

    /// Computes the grey levels of one channel in a range of the row over their `background`.
    fn colour(&mut self, channel: usize, background: &[f32], range: Range<usize>) {
        const LANES: usize = 16;
        let light = &self.light[channel][range.clone()];
        let levels = self.levels[channel][range].chunks_mut(LANES);
        for ((levels, background), light) in levels.zip(background.chunks(LANES)).zip(light.chunks(LANES)) {
            let mut values = [0.0; LANES];
            let products = background.iter().zip(light).map(|(base, light)| base * light);
            values.iter_mut().zip(products).for_each(|(value, product)| *value = product);
            levels.copy_from_slice(&grey_levels(&values)[..levels.len()]);
        }
    }
}

/// Rounds and clamps to grey levels.
fn grey_levels(values: &[f32; 16]) -> [u8; 16] {
    // Written out, since the compiler does not vectorise the conversion. Narrowing saturates.
    let [low, high] = [0, 8].map(|at| {
        let lanes = f32x8::new(std::array::from_fn(|lane| values[at + lane])) + f32x8::HALF;
        // Truncation is as good as the floor: negative values become 0.
        i16x8::from_i32x8_saturate(lanes.trunc_int())
    });
    u8x16::narrow_i16x8(low, high).to_array()
}

fn grey_level(value: f32) -> u8 {
    grey_levels(&[value; 16])[0]
}

/// Grey levels of a cosine series per channel, 320 × 240.
fn cosine_series(series: &[Vec<Vec<f64>>; 3]) -> [Vec<f32>; 3] {
    let [width, height] = IMAGE_SIZE;
    let rows = || series.iter().flatten();
    let along_x = cosine_waves(rows().map(Vec::len).max().unwrap_or(0), width);
    let along_y = cosine_waves(series.iter().map(Vec::len).max().unwrap_or(0), height);
    series.each_ref().map(|rows| {
        let mut levels = Vec::with_capacity(width * height);
        for y in 0..height {
            let mut line = vec![0.0; along_x.len()];
            for (row, wave) in rows.iter().zip(&along_y) {
                line.iter_mut().zip(row).for_each(|(sum, c)| *sum += wave[y] * c);
            }
            let level = |x: usize| line.iter().zip(&along_x).map(|(c, wave)| c * wave[x]).sum::<f64>();
            levels.extend((0..width).map(|x| level(x) as f32));
        }
        levels
    })
}

/// Cosine waves of the orders 0 to `count`, at the centres of `pixels` pixels.
fn cosine_waves(count: usize, pixels: usize) -> Vec<Vec<f64>> {
    let wave =
        |n: usize, p: usize| (std::f64::consts::PI * n as f64 * (p as f64 + 0.5) / pixels as f64).cos();
    (0..count).map(|n| (0..pixels).map(|p| wave(n, p)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    impl PolynomialOptics {
        /// Change of the colour (R, G, B, grey levels of 255) at a pixel (x, y) by a surface whose slope has the sines
        /// (a, b). Pixels outside the image are clamped to its border.
        pub(in super::super) fn colour_change(&self, a: f64, b: f64, pixel: [usize; 2]) -> [f64; 3] {
            let scale = (f64::from(self.steepest) / a.hypot(b).max(1e-12)).min(1.0);
            let slopes = slope_monomials(a * scale, b * scale);
            let at = pixel[1].min(IMAGE_SIZE[1] - 1) * IMAGE_SIZE[0] + pixel[0].min(IMAGE_SIZE[0] - 1);
            [0, 1, 2].map(|channel| {
                let share: f64 =
                    self.colour[channel].iter().zip(&slopes).map(|(c, s)| f64::from(*c) * s).sum();
                f64::from(self.background[channel][at]) * share
            })
        }
    }

    #[test]
    fn a_row_of_pixels_follows_the_same_law_as_a_single_slope() {
        let optics = PolynomialOptics::gelsight_mini().expect("shipped");
        let slopes: Vec<[f32; 2]> = (0..200)
            .map(|i| {
                let turn = 0.37 * i as f32;
                [turn.cos(), turn.sin()].map(|v| v * 0.005 * i as f32)
            })
            .collect();
        let mut line = LightRow::new(slopes.len());
        // As tangents, which the row turns into sines.
        let tangent = |v: f32, s: &[f32; 2]| v / (1.0 - (s[0] * s[0] + s[1] * s[1])).max(1e-3).sqrt();
        line.a = slopes.iter().map(|s| tangent(s[0], s)).collect();
        line.b = slopes.iter().map(|s| tangent(s[1], s)).collect();
        let range = line.slopes_to_sines(optics.steepest).expect("slopes");
        assert_eq!(range, 1..200);
        for (channel, colour) in optics.colour.iter().enumerate() {
            line.compute_light(channel, colour, 0..200);
            for (i, s) in slopes.iter().enumerate() {
                let pixel = [i, 100];
                let single = optics.colour_change(f64::from(s[0]), f64::from(s[1]), pixel)[channel];
                let base = optics.background[channel][100 * IMAGE_SIZE[0] + i];
                let found = f64::from(base * line.light[channel][i] - base);
                assert!((found - single).abs() < 0.05, "channel {channel}, {s:?}: {found} and {single}");
            }
        }
    }

    #[test]
    fn a_file_with_too_few_numbers_is_refused_by_name() {
        let mut file: OpticsFile = serde_json::from_str(GELSIGHT_MINI).expect("shipped");
        file.colour[1].pop();
        let text = serde_json::to_string(&file).expect("plain data");
        let message = PolynomialOptics::parse(&text).expect_err("19 numbers").to_string();
        assert_eq!(message, "optics: colour has 19 entries per channel, expected 20");
    }
}
