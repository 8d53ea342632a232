//! The tactile picture: our model, a smooth polynomial of slope and place fitted to a real GelSight Mini.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{
    field::GelField,
    gel::Gel,
    shadow::{Lamp, Shade},
    spec::PICTURE,
    surface::{FLAT, Window},
};

/// The coefficients that are shipped, made by `examples/fit_gelsight.rs`.
const MINI: &str = include_str!("../../../assets/gelsight/mini.json");

/// Monomials of the slope of degree 1 to 5: a flat surface has no change of colour, exactly.
pub const SLOPES: usize = 20;
const DEGREE: i32 = 5;

/// A fitted sensor as it stands in its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpticsFile {
    /// What it was fitted to: name, licence, source, date.
    pub source: String,
    /// What was assumed and found.
    pub note: String,
    /// Radius of the ball of the calibration, mm.
    pub ball_radius_mm: f64,
    /// Mean error in the contact circles of pictures left out of the fit, of 255.
    pub held_out_l1: f64,
    /// Greatest sine of slope in the fit; steeper surfaces are coloured like this.
    pub steepest: f64,
    /// Cosine series of the untouched picture, by channel: `background[c][j][i]` times cos(π i u) cos(π j v) with
    /// (u, v) in 0..1 across the picture.
    pub background: [Vec<Vec<f64>>; 3],
    /// By channel and monomial of slope: change of the light as a share of the untouched one; see [`monomials`].
    pub colour: [Vec<f64>; 3],
}

/// A sensor's optics, ready for use.
///
/// A slope multiplies the light that falls on its place: the untouched picture says how much that is. (Lambert's law for
/// a lamp of one elevation; the same slope has the same sign of change wherever it is.)
#[derive(Clone, Debug)]
pub struct Optics {
    background: Vec<u8>,
    smooth: Vec<f32>,
    steepest: f32,
    colour: [[f32; SLOPES]; 3],
    lamps: [Lamp; 3],
}

/// Coefficients that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OpticsError {
    /// Not JSON of the right form.
    #[error("optics: {0}")]
    Format(String),
    /// A wrong number of coefficients.
    #[error("optics: {field} has {found} entries a channel, expected {expected}")]
    Count {
        /// Which list.
        field: &'static str,
        /// How many it has.
        found: usize,
        /// How many it should have.
        expected: usize,
    },
}

/// The monomials aⁱ bʲ, 1 ≤ i + j ≤ 5, of the sines (a, b) of the slope along x and y: by degree, then by rising i.
pub fn monomials(a: f64, b: f64) -> [f64; SLOPES] {
    let mut out = [0.0; SLOPES];
    let powers = (1..=DEGREE).flat_map(|degree| (0..=degree).map(move |i| (i, degree - i)));
    out.iter_mut().zip(powers).for_each(|(out, (i, j))| *out = a.powi(i) * b.powi(j));
    out
}

impl Optics {
    /// The GelSight Mini that is shipped.
    ///
    /// # Errors
    /// The shipped file is broken.
    pub fn mini() -> Result<Self, OpticsError> {
        Self::parse(MINI)
    }

    /// Optics of a file's text.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn parse(text: &str) -> Result<Self, OpticsError> {
        let file: OpticsFile = serde_json::from_str(text).map_err(|e| OpticsError::Format(e.to_string()))?;
        let mut colour = [[0.0; SLOPES]; 3];
        for (to, from) in colour.iter_mut().zip(&file.colour) {
            if from.len() != SLOPES {
                return Err(OpticsError::Count { field: "colour", found: from.len(), expected: SLOPES });
            }
            to.iter_mut().zip(from).for_each(|(to, &from)| *to = from as f32);
        }
        let smooth = background(&file.background);
        Ok(Self {
            background: smooth.iter().map(|&value| level(value)).collect(),
            smooth,
            steepest: file.steepest as f32,
            lamps: colour.map(|c| Lamp::of(c[1], c[0])),
            colour,
        })
    }

    /// The untouched picture, 320 × 240 RGB.
    pub fn untouched(&self) -> &[u8] {
        &self.background
    }

    /// The lamps of red, green and blue.
    pub fn lamps(&self) -> &[Lamp; 3] {
        &self.lamps
    }

    /// The picture of a touch into `rgb` (320 × 240 RGB; cut short if it is shorter), with cast shadows if wanted. Without
    /// a touch it is the untouched picture to the byte, and so is every pixel whose slope has not changed.
    pub fn picture(&self, gel: &Gel, field: Option<&GelField>, shadows: bool, rgb: &mut [u8]) {
        let n = rgb.len().min(self.background.len());
        rgb[..n].copy_from_slice(&self.background[..n]);
        let Some(field) = field else { return };
        if n < self.background.len() {
            return;
        }
        let window = Window::of(gel, field);
        let pitch = gel.view.pitch as f32;
        let shade = shadows.then(|| Shade::new(&window, pitch));
        let [wide, high] = window.size;
        let mut line = Line::new(wide);
        for row in 0..high {
            window.slopes(row, pitch, &mut line.a, &mut line.b);
            // A shadow may fall on flat ground.
            let whole = shade.as_ref().map(|_| (0, wide));
            let Some((first, end)) = whole.or(line.limit(self.steepest)) else { continue };
            for (channel, colour) in self.colour.iter().enumerate() {
                line.light(channel, colour, first..end);
                if let Some(shade) = &shade {
                    shade.cast(&self.lamps[channel], row, first, &mut line.light[channel][first..end]);
                }
            }
            let at = 3 * ((window.from[1] + row) * PICTURE[0] + window.from[0]);
            let (from, to) = (at + 3 * first, at + 3 * end);
            let [red, green, blue] = &line.light;
            let light = red[first..end].iter().zip(&green[first..end]).zip(&blue[first..end]);
            let pixels = rgb[from..to].chunks_exact_mut(3).zip(self.smooth[from..to].chunks_exact(3));
            for ((out, base), ((r, g), b)) in pixels.zip(light) {
                out[0] = level(base[0] * r);
                out[1] = level(base[1] * g);
                out[2] = level(base[2] * b);
            }
        }
    }

    /// Change of the colour (R, G, B, of 255) at pixel (x, y), within the picture, by a surface with sines of slope (a, b).
    pub fn change(&self, a: f64, b: f64, pixel: [usize; 2]) -> [f64; 3] {
        let scale = (f64::from(self.steepest) / a.hypot(b).max(1e-12)).min(1.0);
        let slopes = monomials(a * scale, b * scale);
        let at = 3 * (pixel[1].min(PICTURE[1] - 1) * PICTURE[0] + pixel[0].min(PICTURE[0] - 1));
        [0, 1, 2].map(|channel| {
            let share: f64 = self.colour[channel].iter().zip(&slopes).map(|(c, s)| f64::from(*c) * s).sum();
            f64::from(self.smooth[at + channel]) * share
        })
    }
}

/// One row of pixels.
struct Line {
    /// Sines of the slope along x and y.
    a: Vec<f32>,
    b: Vec<f32>,
    /// By channel: the light over that of the untouched picture.
    light: [Vec<f32>; 3],
}

impl Line {
    fn new(wide: usize) -> Self {
        Self { a: vec![0.0; wide], b: vec![0.0; wide], light: std::array::from_fn(|_| vec![0.0; wide]) }
    }

    /// Turns slopes into sines, none above `steepest`; from where to where there is any to speak of.
    fn limit(&mut self, steepest: f32) -> Option<(usize, usize)> {
        for (a, b) in self.a.iter_mut().zip(&mut self.b) {
            let square = *a * *a + *b * *b;
            let scale = (1.0 / (1.0 + square)).sqrt().min(steepest / square.max(1e-20).sqrt());
            (*a, *b) = (*a * scale, *b * scale);
        }
        let steep = |(a, b): (&f32, &f32)| a.abs().max(b.abs()) > FLAT;
        let first = self.a.iter().zip(&self.b).position(steep)?;
        let end = self.a.iter().zip(&self.b).rposition(steep)? + 1;
        Some((first, end))
    }

    /// Light of one channel along the row.
    fn light(&mut self, channel: usize, c: &[f32; SLOPES], range: Range<usize>) {
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
}

fn level(value: f32) -> u8 {
    // By way of an integer, which the compiler turns into vector instructions.
    (value + 0.5).clamp(0.0, 255.0) as i32 as u8
}

/// The untouched picture of its cosine series, 320 × 240 RGB.
fn background(series: &[Vec<Vec<f64>>; 3]) -> Vec<f32> {
    let [wide, high] = PICTURE;
    let wave = |n: usize, p: usize, of: usize| {
        (std::f64::consts::PI * n as f64 * (p as f64 + 0.5) / of as f64).cos()
    };
    let mut out = vec![0.0; 3 * wide * high];
    for (channel, rows) in series.iter().enumerate() {
        for y in 0..high {
            let most = rows.iter().map(Vec::len).max().unwrap_or(0);
            let mut line = vec![0.0; most];
            for (j, row) in rows.iter().enumerate() {
                let w = wave(j, y, high);
                line.iter_mut().zip(row).for_each(|(sum, c)| *sum += w * c);
            }
            for x in 0..wide {
                let value: f64 = line.iter().enumerate().map(|(i, c)| c * wave(i, x, wide)).sum();
                out[3 * (y * wide + x) + channel] = value as f32;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_pixels_follows_the_same_law_as_a_single_slope() {
        let optics = Optics::mini().expect("shipped");
        let slopes: Vec<[f32; 2]> = (0..200)
            .map(|i| {
                let turn = 0.37 * i as f32;
                [turn.cos(), turn.sin()].map(|v| v * 0.005 * i as f32)
            })
            .collect();
        let mut line = Line::new(slopes.len());
        // As tangents, which the row turns into sines.
        let tangent = |v: f32, s: &[f32; 2]| v / (1.0 - (s[0] * s[0] + s[1] * s[1])).max(1e-3).sqrt();
        line.a = slopes.iter().map(|s| tangent(s[0], s)).collect();
        line.b = slopes.iter().map(|s| tangent(s[1], s)).collect();
        let (first, end) = line.limit(optics.steepest).expect("slopes");
        assert_eq!((first, end), (1, 200));
        for (channel, colour) in optics.colour.iter().enumerate() {
            line.light(channel, colour, 0..200);
            for (i, s) in slopes.iter().enumerate() {
                let pixel = [i, 100];
                let single = optics.change(f64::from(s[0]), f64::from(s[1]), pixel)[channel];
                let base = optics.smooth[3 * (100 * PICTURE[0] + i) + channel];
                let found = f64::from(base * line.light[channel][i] - base);
                assert!((found - single).abs() < 0.05, "channel {channel}, {s:?}: {found} and {single}");
            }
        }
    }

    #[test]
    fn a_file_with_too_few_numbers_is_refused_by_name() {
        let mut file: OpticsFile = serde_json::from_str(MINI).expect("shipped");
        file.colour[1].pop();
        let text = serde_json::to_string(&file).expect("plain data");
        let message = Optics::parse(&text).expect_err("19 numbers").to_string();
        assert_eq!(message, "optics: colour has 19 entries a channel, expected 20");
    }
}
