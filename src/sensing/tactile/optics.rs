//! The tactile picture: our model, a smooth polynomial of slope and place fitted to a real GelSight Mini.

use serde::{Deserialize, Serialize};

use super::{field::GelField, gel::Gel, spec::PICTURE, surface::Window};

/// The coefficients that are shipped, made by `examples/fit_gelsight.rs`.
const MINI: &str = include_str!("../../../assets/gelsight/mini.json");

/// Monomials of the slope of degree 1 to 4: a flat surface has no change of colour, exactly.
pub const SLOPES: usize = 14;
/// Monomials of the place: 1, x, y, x², xy, y².
pub const PLACES: usize = 6;

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
    /// By channel and monomial of slope, then of place, with (x, y) in −1..1 across the picture; see [`monomials`].
    pub colour: [Vec<[f64; PLACES]>; 3],
}

/// A sensor's optics, ready for use.
#[derive(Clone, Debug)]
pub struct Optics {
    background: Vec<u8>,
    smooth: Vec<f32>,
    steepest: f32,
    colour: [Vec<[f32; PLACES]>; 3],
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

/// The monomials aⁱ bʲ, 1 ≤ i + j ≤ 4, of the sines (a, b) of the slope along x and y: by degree, then by rising i.
pub fn monomials(a: f64, b: f64) -> [f64; SLOPES] {
    let (a2, b2) = (a * a, b * b);
    let (ab, a3, b3) = (a * b, a2 * a, b2 * b);
    [b, a, b2, ab, a2, b3, a * b2, a2 * b, a3, b2 * b2, a * b3, a2 * b2, a3 * b, a2 * a2]
}

/// The monomials of the place.
pub fn places(x: f64, y: f64) -> [f64; PLACES] {
    [1.0, x, y, x * x, x * y, y * y]
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
        for colour in &file.colour {
            if colour.len() != SLOPES {
                return Err(OpticsError::Count { field: "colour", found: colour.len(), expected: SLOPES });
            }
        }
        let smooth = background(&file.background);
        Ok(Self {
            background: smooth.iter().map(|&value| level(value)).collect(),
            smooth,
            steepest: file.steepest as f32,
            colour: file.colour.map(|c| c.into_iter().map(|p| p.map(|v| v as f32)).collect()),
        })
    }

    /// The untouched picture, 320 × 240 RGB.
    pub fn untouched(&self) -> &[u8] {
        &self.background
    }

    /// The picture of a touch into `rgb` (320 × 240 RGB; cut short if it is shorter). Without a touch it is the untouched
    /// picture to the byte, and so is every pixel whose slope has not changed.
    pub fn picture(&self, gel: &Gel, field: Option<&GelField>, rgb: &mut [u8]) {
        let n = rgb.len().min(self.background.len());
        rgb[..n].copy_from_slice(&self.background[..n]);
        let Some(field) = field else { return };
        if n < self.background.len() {
            return;
        }
        let window = Window::of(gel, field);
        let [wide, high] = window.size;
        let mut line = Line::new(wide);
        for row in 0..high {
            window.slopes(row, gel.view.pitch as f32, &mut line.a, &mut line.b);
            line.limit(self.steepest);
            let at = 3 * ((window.from[1] + row) * PICTURE[0] + window.from[0]);
            let y = ((window.from[1] + row) as f32 + 0.5) * 2.0 / PICTURE[1] as f32 - 1.0;
            for (channel, colour) in self.colour.iter().enumerate() {
                line.change(colour, window.from[0], y);
                let base = &self.smooth[at..at + 3 * wide];
                let out = &mut rgb[at..at + 3 * wide];
                for (i, change) in line.change.iter().enumerate() {
                    out[3 * i + channel] = level(base[3 * i + channel] + change);
                }
            }
        }
    }

    /// Change of the colour (R, G, B, of 255) at picture place (x, y), −1..1, by a surface with sines of slope (a, b).
    pub fn change(&self, a: f64, b: f64, x: f64, y: f64) -> [f64; 3] {
        let (slopes, places) = (monomials(a, b), places(x, y));
        [0, 1, 2].map(|channel| {
            let rows = self.colour[channel].iter().zip(&slopes);
            rows.map(|(row, s)| s * row.iter().zip(&places).map(|(c, p)| f64::from(*c) * p).sum::<f64>())
                .sum()
        })
    }
}

/// One row of pixels.
struct Line {
    /// Sines of the slope along x and y.
    a: Vec<f32>,
    b: Vec<f32>,
    change: Vec<f32>,
}

impl Line {
    fn new(wide: usize) -> Self {
        Self { a: vec![0.0; wide], b: vec![0.0; wide], change: vec![0.0; wide] }
    }

    /// Turns slopes into sines, none above `steepest`.
    fn limit(&mut self, steepest: f32) {
        for (a, b) in self.a.iter_mut().zip(&mut self.b) {
            let square = *a * *a + *b * *b;
            let sine = (square / (1.0 + square)).sqrt();
            let scale = sine.min(steepest) / square.sqrt().max(1e-12);
            (*a, *b) = (*a * scale, *b * scale);
        }
    }

    /// Change of one channel along the row, from pixel column `from`, at height `y`.
    fn change(&mut self, colour: &[[f32; PLACES]], from: usize, y: f32) {
        // In a row each coefficient is a parabola of x.
        let mut parabolas = [[0.0_f32; 3]; SLOPES];
        for (parabola, c) in parabolas.iter_mut().zip(colour) {
            *parabola = [c[0] + y * (c[2] + y * c[5]), c[1] + y * c[4], c[3]];
        }
        let step = 2.0 / PICTURE[0] as f32;
        let places = self.a.iter().zip(&self.b).zip(&mut self.change).enumerate();
        for (i, ((&a, &b), change)) in places {
            let x = ((from + i) as f32 + 0.5) * step - 1.0;
            let c = |m: usize| parabolas[m][0] + x * (parabolas[m][1] + x * parabolas[m][2]);
            // By powers of a, Horner's rule in b within each.
            let a0 = b * (c(0) + b * (c(2) + b * (c(5) + b * c(9))));
            let a1 = c(1) + b * (c(3) + b * (c(6) + b * c(10)));
            let a2 = c(4) + b * (c(7) + b * c(11));
            let a3 = c(8) + b * c(12);
            *change = a0 + a * (a1 + a * (a2 + a * (a3 + a * c(13))));
        }
    }
}

fn level(value: f32) -> u8 {
    (value + 0.5).clamp(0.0, 255.0) as u8
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
