//! Taxim's image (Si & Yuan, *Taxim: An Example-based Simulation Model for GelSight Tactile Sensors*, RA-L 2022): the
//! model of the paper, with calibration tables of the user, without shadows, as SoftVTBench runs it.
//!
//! Here the shape of the gel is not elastic: the dent is a pyramid of Gaussian blurs. Colours come from a table over
//! magnitude and direction of the slope; each entry is a quadratic polynomial of the pixel position at 640 × 480. The
//! Mini's gel map is flat, adds no slope, and is not read. The files are from the PyPI package `taxim`, with red
//! and blue exchanged as there.

use std::{f64::consts::PI, path::Path};

use image::{Rgb, RgbImage};

use super::super::elastic::{Gel, GelField};
use softvt_common::npy::{NpyError, read_npz_of};
use softvt_robot::tactile::IMAGE_SIZE;

/// σ of the blurs of the pyramid, px of 320 × 240 (kernel sizes 201, 101, 51, 21, 11 and 5 at 640 × 480).
const PYRAMID: [f32; 6] = [15.25, 7.75, 4.0, 1.75, 1.0, 0.55];
/// σ of the last blur, px.
const FINAL_BLUR: f32 = 1.0;
/// Share of the greatest depth above which a touching point keeps the shape of the object.
const CONTACT_SHARE: f32 = 0.4;
/// σ of the blurred untouched image in the background, px.
const BACKGROUND_BLUR: f32 = 25.0;
/// Share of the blurred untouched image in the background.
const BACKGROUND_SHARE: f32 = 0.15;
/// Largest accepted number of bins.
const MAX_BINS: f64 = 4096.0;

/// Optics of Taxim with the calibration tables of a sensor.
#[derive(Clone, Debug)]
pub struct TaximOptics {
    bins: usize,
    /// Six coefficients per bin, by channel R, G, B; bins by magnitude, then direction of the slope.
    table: [Vec<f32>; 3],
    /// Image that changes are added to, RGB.
    background: Vec<f32>,
}

impl TaximOptics {
    /// Reads `polycalib.npz` (`bins`, `grad_r`, `grad_g`, `grad_b`) and `dataPack.npz` (`f0`) in `folder`.
    ///
    /// # Errors
    /// Names the file and the key that is missing, of a wrong shape or type, or not finite.
    pub fn load(folder: &Path) -> Result<Self, NpyError> {
        let path = folder.join("polycalib.npz");
        let bins = read_shaped(&path, "bins", &["i4", "i8"], &[], "[] of one number")?[0];
        if !(2.0..=MAX_BINS).contains(&bins) {
            let reason = format_args!("array \"bins\": expected 2..{MAX_BINS}, got {bins}");
            return Err(NpyError::new(&path, reason));
        }
        let bins = bins as usize;
        let channel = |key: &str| {
            let expected = format!("[{bins}, {bins}, 6] of \"bins\"");
            let values = read_shaped(&path, key, &["f4", "f8"], &[bins, bins, 6], &expected)?;
            Ok(values.into_iter().map(|v| v as f32).collect::<Vec<f32>>())
        };
        let table = [channel("grad_b")?, channel("grad_g")?, channel("grad_r")?];
        let shape = [2 * IMAGE_SIZE[1], 2 * IMAGE_SIZE[0], 3];
        let f0 = read_shaped(&folder.join("dataPack.npz"), "f0", &["u1"], &shape, &format!("{shape:?}"))?;
        Ok(Self { bins, table, background: background(&f0) })
    }

    /// Image of a field, 320 × 240. The image without a field also differs from the untouched one, by the table's
    /// entry for a flat surface, as in Taxim.
    pub fn render(&self, gel: &Gel, field: Option<&GelField>) -> RgbImage {
        let [width, height] = IMAGE_SIZE;
        let depth = field.map_or_else(|| vec![0.0; width * height], |field| dent(gel, field));
        let slope = 0.5 / gel.view.pitch as f32;
        RgbImage::from_fn(width as u32, height as u32, |x, y| {
            let (x, y) = (x as usize, y as usize);
            let at = |x: usize, y: usize| depth[y * width + x];
            let gx = slope * (at((x + 1).min(width - 1), y) - at(x.saturating_sub(1), y));
            let gy = slope * (at(x, (y + 1).min(height - 1)) - at(x, y.saturating_sub(1)));
            let entry = 6 * self.entry(gx, gy);
            let (u, v) = (2.0 * x as f32, 2.0 * y as f32);
            Rgb([0, 1, 2].map(|channel| {
                let t = &self.table[channel][entry..entry + 6];
                let change = t[0] * u * u + t[1] * v * v + t[2] * u * v + t[3] * u + t[4] * v + t[5];
                (self.background[3 * (y * width + x) + channel] + change + 0.5).clamp(0.0, 255.0) as u8
            }))
        })
    }

    /// Index of the bin of a slope.
    fn entry(&self, gx: f32, gy: f32) -> usize {
        let last = (self.bins - 1) as f64;
        let magnitude = f64::from(gx.hypot(gy)).atan() / (0.5 * PI / last);
        let direction = (f64::from(gy).atan2(f64::from(gx)) + PI) / (2.0 * PI / last);
        let bin = |value: f64| (value as usize).min(self.bins - 1);
        bin(magnitude) * self.bins + bin(direction)
    }
}

/// Numbers of an array that must have this shape, which `expected` describes.
fn read_shaped(
    path: &Path,
    key: &str,
    kinds: &[&str],
    shape: &[usize],
    expected: &str,
) -> Result<Vec<f64>, NpyError> {
    let array = read_npz_of(path, key, kinds)?;
    if array.shape != shape {
        let reason = format_args!("array \"{key}\": expected the shape {expected}, got {:?}", array.shape);
        return Err(NpyError::new(path, reason));
    }
    Ok(array.values())
}

/// Depth of the dent at each pixel, m.
fn dent(gel: &Gel, field: &GelField) -> Vec<f32> {
    let [width, height] = IMAGE_SIZE;
    let map = &field.height_map;
    let index = |metres: f64, count: usize| {
        (metres / map.cell + 0.5 * (count - 1) as f64).round().clamp(0.0, (count - 1) as f64) as usize
    };
    let mut shape = vec![0.0; width * height];
    for (p, value) in shape.iter_mut().enumerate() {
        let (x, y) = (gel.view.pixel_centre(0, p % width), gel.view.pixel_centre(1, p / width));
        let skin = map.height[index(y, map.rows) * map.columns + index(x, map.columns)];
        *value = (gel.pad.height(x, y) as f32 - skin).max(0.0);
    }
    let depth = shape.iter().copied().fold(0.0, f32::max);
    let mut height = shape.clone();
    for sigma in PYRAMID {
        blur(&mut height, width, 1, sigma);
        for (h, &s) in height.iter_mut().zip(&shape) {
            if s > CONTACT_SHARE * depth {
                *h = s;
            }
        }
    }
    blur(&mut height, width, 1, FINAL_BLUR);
    height
}

/// Untouched image at half size, RGB, mixed with a blurred copy as in Taxim.
fn background(f0: &[f64]) -> Vec<f32> {
    let [width, height] = IMAGE_SIZE;
    let mut half = vec![0.0; 3 * width * height];
    for (p, value) in half.iter_mut().enumerate() {
        let (channel, x, y) = (2 - p % 3, p / 3 % width, p / 3 / width);
        let at = |dx: usize, dy: usize| f0[3 * ((2 * y + dy) * 2 * width + 2 * x + dx) + channel];
        *value = (0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))) as f32;
    }
    let mut smooth = half.clone();
    blur(&mut smooth, width, 3, BACKGROUND_BLUR);
    half.iter().zip(&smooth).map(|(f, s)| BACKGROUND_SHARE * s + (1.0 - BACKGROUND_SHARE) * f).collect()
}

/// Gaussian blur of an image of `channels` interleaved numbers per pixel, truncated at 3 σ, with repeated borders.
fn blur(image: &mut [f32], width: usize, channels: usize, sigma: f32) {
    let height = image.len() / width / channels;
    let reach = (3.0 * sigma).ceil() as isize;
    let weights: Vec<f32> = (-reach..=reach).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let total: f32 = weights.iter().sum();
    for (count, stride, lines) in [(width, channels, height), (height, width * channels, width)] {
        let mut line = vec![0.0; count];
        for l in 0..lines {
            for channel in 0..channels {
                let from = channel + l * if stride == channels { width * channels } else { channels };
                line.iter_mut().enumerate().for_each(|(i, v)| *v = image[from + i * stride]);
                for i in 0..count {
                    let tap = |k: usize| {
                        line[(i as isize + k as isize - reach).clamp(0, count as isize - 1) as usize]
                    };
                    let sum: f32 = weights.iter().enumerate().map(|(k, w)| w * tap(k)).sum();
                    image[from + i * stride] = sum / total;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
