//! Taxim's picture (Si & Yuan, *Taxim: An Example-based Simulation Model for GelSight Tactile Sensors*, RA-L 2022), the
//! paper's model, with tables that the user has. Without shadows, as SoftVTBench runs it.
//!
//! The gel's shape is not elastic here: the dent is a pyramid of Gaussian blurs. Colours come from a table over size and
//! direction of the slope, each entry a quadratic of the place in pixels of 640 × 480. The Mini's gel map is flat and so
//! adds no slope; it is not read. Files as the PyPI package `taxim` has them, red and blue exchanged as there.

use std::{f64::consts::PI, path::Path};

use super::{
    field::GelField,
    gel::Gel,
    npz::{NpzError, read_npz_of},
    spec::PICTURE,
};

/// σ of the pyramid's blurs and of the last one, px of 320 × 240 (sizes 201, 101, 51, 21, 11 and 5 at 640 × 480).
const PYRAMID: [f32; 6] = [15.25, 7.75, 4.0, 1.75, 1.0, 0.55];
const LAST: f32 = 1.0;
/// Share of the depth beyond which a touching point keeps the object's shape.
const FIXED: f32 = 0.4;
/// σ and share of the smoothed untouched picture in the background.
const SMOOTH: f32 = 25.0;
const MIXED: f32 = 0.15;
/// More bins than that are no table of this kind.
const MOST_BINS: f64 = 4096.0;

/// Taxim's tables of a sensor.
#[derive(Clone, Debug)]
pub struct Taxim {
    bins: usize,
    /// Six numbers a bin, by channel R, G, B; bins by size, then direction.
    table: [Vec<f32>; 3],
    background: Vec<f32>,
}

impl Taxim {
    /// Reads `polycalib.npz` (`bins`, `grad_r`, `grad_g`, `grad_b`) and `dataPack.npz` (`f0`) in `folder`.
    ///
    /// # Errors
    /// Names the file and the key that is missing, of a wrong shape or type, or has an entry that is no number.
    pub fn load(folder: &Path) -> Result<Self, NpzError> {
        let path = folder.join("polycalib.npz");
        let wrong = |path: &Path, key: &str, expected: String, found: &[usize]| NpzError::Content {
            path: path.into(),
            what: format!("array \"{key}\": expected the shape {expected}, got {found:?}"),
        };
        let one = read_npz_of(&path, "bins", &["i4", "i8"])?;
        let bins = match one.values()[..] {
            [bins] if (2.0..=MOST_BINS).contains(&bins) => bins as usize,
            [bins] => {
                let what = format!("array \"bins\": expected 2..{MOST_BINS}, got {bins}");
                return Err(NpzError::Content { path, what });
            }
            _ => return Err(wrong(&path, "bins", "[] of one number".into(), &one.shape)),
        };
        let channel = |key: &str| {
            let array = read_npz_of(&path, key, &["f4", "f8"])?;
            if array.shape != [bins, bins, 6] {
                return Err(wrong(&path, key, format!("[{bins}, {bins}, 6] of \"bins\""), &array.shape));
            }
            Ok(array.values().into_iter().map(|v| v as f32).collect::<Vec<f32>>())
        };
        let table = [channel("grad_b")?, channel("grad_g")?, channel("grad_r")?];
        let path = folder.join("dataPack.npz");
        let f0 = read_npz_of(&path, "f0", &["u1"])?;
        let [wide, high] = PICTURE;
        if f0.shape != [2 * high, 2 * wide, 3] {
            return Err(wrong(&path, "f0", format!("[{}, {}, 3]", 2 * high, 2 * wide), &f0.shape));
        }
        Ok(Self { bins, table, background: background(&f0.values()) })
    }

    /// The picture into `rgb` (320 × 240 RGB; nothing is written if it is shorter). Taxim changes the untouched picture
    /// too, by what its table has for a flat surface.
    pub fn picture(&self, gel: &Gel, field: Option<&GelField>, rgb: &mut [u8]) {
        let [wide, high] = PICTURE;
        if rgb.len() < 3 * wide * high {
            return;
        }
        let height = field.map_or_else(|| vec![0.0; wide * high], |field| dent(gel, field));
        let slope = 0.5 / gel.view.pitch as f32;
        for y in 0..high {
            for x in 0..wide {
                let at = |x: usize, y: usize| height[y * wide + x];
                let gx = slope * (at((x + 1).min(wide - 1), y) - at(x.saturating_sub(1), y));
                let gy = slope * (at(x, (y + 1).min(high - 1)) - at(x, y.saturating_sub(1)));
                let entry = 6 * self.entry(gx, gy);
                let (u, v) = (2.0 * x as f32, 2.0 * y as f32);
                for (channel, table) in self.table.iter().enumerate() {
                    let t = &table[entry..entry + 6];
                    let change = t[0] * u * u + t[1] * v * v + t[2] * u * v + t[3] * u + t[4] * v + t[5];
                    let pixel = 3 * (y * wide + x) + channel;
                    rgb[pixel] = (self.background[pixel] + change + 0.5).clamp(0.0, 255.0) as u8;
                }
            }
        }
    }

    fn entry(&self, gx: f32, gy: f32) -> usize {
        let last = (self.bins - 1) as f64;
        let size = f64::from(gx.hypot(gy)).atan() / (0.5 * PI / last);
        let direction = (f64::from(gy).atan2(f64::from(gx)) + PI) / (2.0 * PI / last);
        let bin = |value: f64| (value as usize).min(self.bins - 1);
        bin(size) * self.bins + bin(direction)
    }
}

/// How far the surface is pressed at each pixel, m.
fn dent(gel: &Gel, field: &GelField) -> Vec<f32> {
    let [wide, high] = PICTURE;
    let relief = &field.relief;
    let centre = |axis: usize, p: usize| (p as f64 + 0.5 - 0.5 * PICTURE[axis] as f64) * gel.view.pitch;
    let index = |metres: f64, count: usize| {
        (metres / relief.cell + 0.5 * (count - 1) as f64).round().clamp(0.0, (count - 1) as f64) as usize
    };
    let mut shape = vec![0.0; wide * high];
    for (p, value) in shape.iter_mut().enumerate() {
        let (x, y) = (centre(0, p % wide), centre(1, p / wide));
        let skin = relief.height[index(y, relief.rows) * relief.columns + index(x, relief.columns)];
        *value = (gel.pad.height(x, y) as f32 - skin).max(0.0);
    }
    let depth = shape.iter().copied().fold(0.0, f32::max);
    let mut height = shape.clone();
    for sigma in PYRAMID {
        blur(&mut height, wide, 1, sigma);
        for (h, &s) in height.iter_mut().zip(&shape) {
            if s > FIXED * depth {
                *h = s;
            }
        }
    }
    blur(&mut height, wide, 1, LAST);
    height
}

/// The untouched picture at half size, RGB, a little smoothed as Taxim does.
fn background(f0: &[f64]) -> Vec<f32> {
    let [wide, high] = PICTURE;
    let mut half = vec![0.0; 3 * wide * high];
    for (p, value) in half.iter_mut().enumerate() {
        let (channel, x, y) = (2 - p % 3, p / 3 % wide, p / 3 / wide);
        let at = |dx: usize, dy: usize| f0[3 * ((2 * y + dy) * 2 * wide + 2 * x + dx) + channel];
        *value = (0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))) as f32;
    }
    let mut smooth = half.clone();
    blur(&mut smooth, wide, 3, SMOOTH);
    half.iter().zip(&smooth).map(|(f, s)| MIXED * s + (1.0 - MIXED) * f).collect()
}

/// Gaussian blur of an image of `channels` interleaved numbers a pixel, cut at 3 σ, borders repeated.
fn blur(image: &mut [f32], wide: usize, channels: usize, sigma: f32) {
    let high = image.len() / wide / channels;
    let reach = (3.0 * sigma).ceil() as isize;
    let weights: Vec<f32> = (-reach..=reach).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let total: f32 = weights.iter().sum();
    for (count, stride, lines) in [(wide, channels, high), (high, wide * channels, wide)] {
        let mut line = vec![0.0; count];
        for l in 0..lines {
            for channel in 0..channels {
                let from = channel + l * if stride == channels { wide * channels } else { channels };
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
mod tests {
    use super::*;
    use crate::{
        robot::PadSurface,
        sensing::tactile::{PadLoad, TactileSpec, field_tests::graph, field_tests::touch},
    };

    /// Tables that paint red where the surface falls to the right, on a black picture of brightness 10.
    fn painted() -> Taxim {
        let bins = 125;
        let mut red = vec![0.0; bins * bins * 6];
        for size in 5..bins {
            // A direction of 0: the middle bin.
            for direction in 57..67 {
                red[6 * (size * bins + direction) + 5] = 100.0;
            }
        }
        let none = vec![0.0; bins * bins * 6];
        Taxim { bins, table: [red, none.clone(), none], background: vec![10.0; 3 * PICTURE[0] * PICTURE[1]] }
    }

    #[test]
    fn the_table_is_read_at_size_and_direction_of_the_rise() {
        let gel = Gel::new(&TactileSpec::default(), PadSurface::default()).expect("default numbers");
        let ball = graph(8e-3, 2e-4, |x, y| (x * x + y * y) / 8e-3);
        let field = touch(&gel, &ball, PadLoad::new(1.5, [0.0; 2], 0.0, [0.0; 2]));
        let mut rgb = vec![0; 3 * PICTURE[0] * PICTURE[1]];
        painted().picture(&gel, Some(&field), &mut rgb);
        let red = |x: usize, y: usize| rgb[3 * (y * PICTURE[0] + x)];
        // The dent rises towards its middle: to the right on its left side.
        assert_eq!((red(140, 120), red(180, 120), red(160, 100), red(10, 10)), (110, 10, 10, 10));
        painted().picture(&gel, None, &mut rgb);
        assert!(rgb.iter().all(|&value| value == 10));
    }

    #[test]
    fn a_missing_file_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let error = Taxim::load(folder.path()).expect_err("no files").to_string();
        assert!(error.contains("polycalib.npz"), "{error}");
    }

    #[test]
    fn a_blur_keeps_a_constant_and_spreads_a_point() {
        let mut image = vec![3.0; 40 * 30];
        blur(&mut image, 40, 1, 2.0);
        assert!(image.iter().all(|v| (v - 3.0).abs() < 1e-5));
        let mut point = vec![0.0; 41 * 41];
        point[20 * 41 + 20] = 1.0;
        blur(&mut point, 41, 1, 2.0);
        let expected = 1.0 / (2.0 * std::f32::consts::PI * 4.0);
        assert!((point[20 * 41 + 20] / expected - 1.0).abs() < 0.02);
    }
}
