//! Fits the tactile optics to real presses of a ball and writes `assets/gelsight/mini.json`.
//!
//! ```text
//! pip download taxim==1.4.1 --no-deps && unzip taxim-1.4.1-py3-none-any.whl
//! cargo run --release --example fit_gelsight -- taxim/calib/gelsight_mini/dataPack.npz > assets/gelsight/mini.json
//! ```
//!
//! The package (T. Schneider, MIT) holds 24 pictures, 640 × 480, of a ball pressed into a GelSight Mini, the circle of
//! contact of each, and the untouched picture. Within a circle the ball's shape gives the slope at every pixel; ridge
//! regression then finds, for each channel, 14 monomials of the slope × 6 of the place. The error printed (stderr) is
//! that of pictures left out of the fit, four folds. The ball's radius is not documented: 2 mm is what the package's own
//! parameters use; another may be given as the second argument (mm).

use std::{error::Error, f64::consts::PI, path::Path};

use nalgebra::{DMatrix, DVector};
use softvt::sensing::tactile::{
    npz::read_npz,
    optics::{OpticsFile, PLACES, SLOPES, monomials, places},
};

/// Edge of a pixel of a 640 × 480 picture, mm: half of 0.0634, GelSight's own figure at 320 × 240.
const PITCH_MM: f64 = 0.0317;
/// Weight of the ridge, a pixel.
const RIDGE: f64 = 1e-7;
const FOLDS: usize = 4;
/// Waves of the untouched picture along each axis.
const WAVES: usize = 10;
/// Where red, green and blue are in a stored pixel.
const STORED: [usize; 3] = [2, 1, 0];
const TERMS: usize = SLOPES * PLACES;

/// One pixel in a contact circle: its features, and the colours of the press and of the untouched picture.
struct Sample {
    features: [f64; TERMS],
    pressed: [f64; 3],
    untouched: [f64; 3],
}

struct Data {
    /// By picture.
    presses: Vec<Vec<Sample>>,
    untouched: Vec<f64>,
    size: [usize; 2],
    steepest: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let path = words.next().ok_or("expected the path of dataPack.npz")?;
    let radius: f64 = words.next().map_or(Ok(2.0), |word| word.parse())?;
    let data = load(Path::new(&path), radius)?;
    let held_out_l1 = (0..FOLDS).map(|fold| error(&data, fold)).sum::<f64>() / FOLDS as f64;
    eprintln!("held-out L1 in the contact circles: {held_out_l1:.2} of 255");
    let all: Vec<&Sample> = data.presses.iter().flatten().collect();
    let weights = fit(&all).ok_or("the normal equations are singular")?;
    let round = |value: f64| (value * 1e3).round() / 1e3;
    let file = OpticsFile {
        source: "calib/gelsight_mini/dataPack.npz of the PyPI package taxim 1.4.1 (2025-09-17), \
                 https://github.com/TimSchneider42/taxim, MIT licence, Copyright (c) 2021 CMURoboTouch"
            .into(),
        note: format!(
            "made by examples/fit_gelsight.rs; ball radius assumed, pixel pitch {PITCH_MM} mm at 640 x 480"
        ),
        ball_radius_mm: radius,
        held_out_l1: round(held_out_l1),
        steepest: round(data.steepest),
        background: [0, 1, 2]
            .map(|channel| series(&data, channel).map(|row| row.map(round).to_vec()).to_vec()),
        colour: [0, 1, 2].map(|channel| {
            weights[channel].as_slice().chunks(PLACES).map(|c| std::array::from_fn(|p| round(c[p]))).collect()
        }),
    };
    println!("{}", serde_json::to_string(&file)?);
    Ok(())
}

fn load(path: &Path, radius_mm: f64) -> Result<Data, Box<dyn Error>> {
    let (pictures, untouched) = (read_npz(path, "imgs")?, read_npz(path, "f0")?);
    let (centres, radii) =
        (read_npz(path, "touch_center")?.values(), read_npz(path, "touch_radius")?.values());
    let &[count, high, wide, 3] = pictures.shape.as_slice() else {
        return Err(format!("imgs: expected pictures × rows × columns × 3, got {:?}", pictures.shape).into());
    };
    let untouched = untouched.values();
    let mut data = Data { presses: Vec::new(), untouched, size: [wide, high], steepest: 0.0 };
    for i in 0..count {
        let picture = &pictures.bytes[i * high * wide * 3..(i + 1) * high * wide * 3];
        let (cx, cy, r) = (centres[2 * i], centres[2 * i + 1], radii[i]);
        let mut press = Vec::new();
        for y in 0..high {
            for x in 0..wide {
                let (dx, dy) = (x as f64 - cx, y as f64 - cy);
                if dx.hypot(dy) >= r {
                    continue;
                }
                // The sine of the slope of a sphere is the distance from its axis over its radius.
                let (a, b) = (dx * PITCH_MM / radius_mm, dy * PITCH_MM / radius_mm);
                data.steepest = data.steepest.max(a.hypot(b));
                let at = 3 * (y * wide + x);
                press.push(Sample {
                    features: features(a, b, unit(x, wide), unit(y, high)),
                    pressed: std::array::from_fn(|c| f64::from(picture[at + STORED[c]])),
                    untouched: std::array::from_fn(|c| data.untouched[at + STORED[c]]),
                });
            }
        }
        data.presses.push(press);
    }
    if data.steepest >= 1.0 {
        return Err(format!("a ball of {radius_mm} mm has no circles that wide; give a larger radius").into());
    }
    Ok(data)
}

/// −1..1 across the picture.
fn unit(p: usize, of: usize) -> f64 {
    (p as f64 + 0.5) * 2.0 / of as f64 - 1.0
}

fn features(a: f64, b: f64, x: f64, y: f64) -> [f64; TERMS] {
    let (slopes, places) = (monomials(a, b), places(x, y));
    std::array::from_fn(|i| slopes[i / PLACES] * places[i % PLACES])
}

/// Weights of each channel.
fn fit(samples: &[&Sample]) -> Option<[DVector<f64>; 3]> {
    let mut normal = DMatrix::identity(TERMS, TERMS) * (RIDGE * samples.len() as f64);
    let mut right = [0, 1, 2].map(|_| DVector::zeros(TERMS));
    for sample in samples {
        let f = DVector::from_row_slice(&sample.features);
        normal.syger(1.0, &f, &f, 1.0);
        for (channel, right) in right.iter_mut().enumerate() {
            right.axpy(sample.pressed[channel] - sample.untouched[channel], &f, 1.0);
        }
    }
    let factor = normal.cholesky()?;
    Some(right.map(|right| factor.solve(&right)))
}

/// Mean error of the pictures of a fold by what the others say.
fn error(data: &Data, fold: usize) -> f64 {
    let of = |left_out: bool| {
        let chosen = data.presses.iter().enumerate().filter(move |(i, _)| (i % FOLDS == fold) == left_out);
        chosen.flat_map(|(_, press)| press).collect::<Vec<&Sample>>()
    };
    let (train, test) = (of(false), of(true));
    let Some(weights) = fit(&train) else { return f64::NAN };
    let mut sum = 0.0;
    for sample in &test {
        for (channel, weights) in weights.iter().enumerate() {
            let change: f64 = sample.features.iter().zip(weights.iter()).map(|(f, w)| f * w).sum();
            let found = (sample.untouched[channel] + change).clamp(0.0, 255.0);
            sum += (found - sample.pressed[channel]).abs();
        }
    }
    sum / (3 * test.len()) as f64
}

/// The cosine series of a channel of the untouched picture.
fn series(data: &Data, channel: usize) -> [[f64; WAVES]; WAVES] {
    let [wide, high] = data.size;
    let wave = |n: usize, p: usize, of: usize| (PI * n as f64 * (p as f64 + 0.5) / of as f64).cos();
    let norm = |n: usize, of: usize| if n == 0 { 1.0 } else { 2.0 } / of as f64;
    let mut rows = vec![[0.0; WAVES]; high];
    for (y, row) in rows.iter_mut().enumerate() {
        for (i, sum) in row.iter_mut().enumerate() {
            let values =
                (0..wide).map(|x| data.untouched[3 * (y * wide + x) + STORED[channel]] * wave(i, x, wide));
            *sum = norm(i, wide) * values.sum::<f64>();
        }
    }
    std::array::from_fn(|j| {
        std::array::from_fn(|i| {
            norm(j, high) * rows.iter().enumerate().map(|(y, row)| row[i] * wave(j, y, high)).sum::<f64>()
        })
    })
}
