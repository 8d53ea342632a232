//! Fits the tactile optics to real presses of a ball and writes `assets/gelsight/mini.json`.
//!
//! ```text
//! pip download taxim==1.4.1 --no-deps && unzip taxim-1.4.1-py3-none-any.whl
//! cargo run --release --example fit_gelsight -- taxim/calib/gelsight_mini/dataPack.npz > assets/gelsight/mini.json
//! ```
//!
//! The package (T. Schneider, MIT) holds 24 images, 640 × 480, of a ball pressed into a GelSight Mini, the contact
//! circle of each, drawn by hand, and the untouched image. The circles are up to 26 px away from the visible dents. So
//! each circle is first moved to the point where the colour of its image changes fastest, which is the ball's lowest
//! point; its radius is kept. Within a circle the shape of the ball gives the slope at every pixel. Ridge regression
//! then finds, for each channel, the coefficients of 20 monomials of the slope whose sum multiplies the untouched
//! image.
//!
//! The errors printed to stderr are of images left out of the fit, in four folds: every fourth image, a quarter of the
//! images in the order they were taken (other places on the gel), and every fourth image with the circles not moved.
//! The radius of the ball is not documented: 2 mm is the number in the package's own parameters; another may be given
//! as the second argument (mm).

use std::{error::Error, f64::consts::PI, ops::Range, path::Path};

use nalgebra::{DMatrix, DVector};
use softvt::{
    npy::read_npz,
    sensing::tactile::image::{OpticsFile, SLOPE_MONOMIALS, slope_monomials},
};

/// Edge of a pixel of a 640 × 480 image, mm: half of 0.0634, GelSight's own figure at 320 × 240.
const PITCH_MM: f64 = 0.0317;
/// Weight of the ridge, grey levels squared per pixel.
const RIDGE: f64 = 1e-3;
const FOLDS: usize = 4;
/// Terms of the cosine series of the untouched image along each axis.
const WAVES: usize = 10;
/// Positions of red, green and blue in a stored pixel.
const CHANNELS: [usize; 3] = [2, 1, 0];
/// Largest distance searched for the dent from the centre of its circle, px.
const SEARCH_RADIUS: usize = 60;
/// σ of the blur before the search, px.
const BLUR_SIGMA: f64 = 4.0;
/// Share of the fastest change of colour above which pixels count for the centre.
const CENTRE_SHARE: f64 = 0.7;

/// One pixel in a contact circle: its features, and its colours in the press and in the untouched image.
struct Sample {
    monomials: [f64; SLOPE_MONOMIALS],
    pressed: [f64; 3],
    untouched: [f64; 3],
}

/// Image of one press.
struct Press {
    /// 640 × 480, three bytes per pixel, as stored.
    image: Vec<u8>,
    /// Centre of the circle drawn by hand, px.
    drawn: [f64; 2],
    /// Centre of the dent, px.
    centre: [f64; 2],
    radius: f64,
}

struct Data {
    presses: Vec<Press>,
    untouched: Vec<f64>,
    size: [usize; 2],
}

/// Slopes of the ball.
#[derive(Clone, Copy)]
struct Ball {
    /// Sine of the slope per distance from the centre, 1/px.
    per_px: f64,
    /// Greatest sine that enters the fit.
    steepest: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let path = words.next().ok_or("expected the path of dataPack.npz")?;
    let radius: f64 = words.next().map_or(Ok(2.0), |word| word.parse())?;
    let data = load(Path::new(&path))?;
    let ball = Ball::of(&data, radius)?;
    let moved: Vec<Vec<Sample>> = data.presses.iter().map(|p| samples(&data, p, p.centre, ball)).collect();
    let drawn: Vec<Vec<Sample>> = data.presses.iter().map(|p| samples(&data, p, p.drawn, ball)).collect();
    let count = data.presses.len();
    let [every_fourth, quarters]: [fn(usize, usize) -> usize; 2] = [|i, _| i % FOLDS, |i, n| i * FOLDS / n];
    let held_out_l1 = held_out_error(&moved, |i| every_fourth(i, count));
    eprintln!("held-out L1 in the contact circles: {held_out_l1:.2} of 255");
    eprintln!(
        "  a quarter left out in the order taken: {:.2}",
        held_out_error(&moved, |i| quarters(i, count))
    );
    eprintln!("  circles as drawn in the package: {:.2}", held_out_error(&drawn, |i| every_fourth(i, count)));
    for press in &data.presses {
        let [dx, dy] = [0, 1].map(|axis| press.centre[axis] - press.drawn[axis]);
        eprintln!("  circle at {:?} px, dent {dx:+.1}, {dy:+.1} px from it", press.drawn);
    }
    let all: Vec<&Sample> = moved.iter().flatten().collect();
    let weights = fit(&all).ok_or("the normal equations are singular")?;
    let round = |value: f64| (value * 1e3).round() / 1e3;
    let file = OpticsFile {
        source: "calib/gelsight_mini/dataPack.npz of the PyPI package taxim 1.4.1 (2025-09-17), \
                 https://github.com/TimSchneider42/taxim, MIT licence, Copyright (c) 2021 CMURoboTouch"
            .into(),
        note: format!(
            "made by examples/fit_gelsight.rs; ball radius assumed, pixel pitch {PITCH_MM} mm at 640 x 480, \
             circles moved onto their dents"
        ),
        ball_radius_mm: radius,
        held_out_l1: round(held_out_l1),
        steepest: round(ball.steepest),
        background: [0, 1, 2]
            .map(|channel| cosine_series(&data, channel).map(|row| row.map(round).to_vec()).to_vec()),
        colour: weights.map(|w| w.iter().copied().map(round).collect()),
    };
    println!("{}", serde_json::to_string(&file)?);
    Ok(())
}

fn load(path: &Path) -> Result<Data, Box<dyn Error>> {
    let (images, untouched) = (read_npz(path, "imgs")?, read_npz(path, "f0")?.values());
    let (centres, radii) =
        (read_npz(path, "touch_center")?.values(), read_npz(path, "touch_radius")?.values());
    let &[count, high, wide, 3] = images.shape.as_slice() else {
        return Err(format!("imgs: expected images × rows × columns × 3, got {:?}", images.shape).into());
    };
    if centres.len() != 2 * count || radii.len() != count || untouched.len() != 3 * high * wide {
        return Err("touch_center, touch_radius and f0 do not belong to imgs".into());
    }
    let mut data = Data { presses: Vec::new(), untouched, size: [wide, high] };
    for (i, &radius) in radii.iter().enumerate() {
        let image = images.data[i * high * wide * 3..(i + 1) * high * wide * 3].to_vec();
        let drawn = [centres[2 * i], centres[2 * i + 1]];
        let centre = find_dent(&data, &image, drawn);
        data.presses.push(Press { image, drawn, centre, radius });
    }
    Ok(data)
}

impl Ball {
    /// Ball of a radius in mm.
    fn of(data: &Data, radius_mm: f64) -> Result<Self, Box<dyn Error>> {
        // The sine of the slope of a sphere is the distance from its axis over its radius.
        let per_px = PITCH_MM / radius_mm;
        let mut edges: Vec<f64> = data.presses.iter().map(|press| press.radius * per_px).collect();
        edges.sort_by(f64::total_cmp);
        if edges.last().is_none_or(|&edge| edge >= 1.0) {
            return Err(
                format!("a ball of {radius_mm} mm has no circles that wide; give a larger radius").into()
            );
        }
        // Fewer than half of the presses have steeper pixels.
        Ok(Self { per_px, steepest: edges[edges.len() / 2] })
    }
}

/// Centre of the dent of a press, px: the point near `drawn` where the colour changes fastest.
fn find_dent(data: &Data, image: &[u8], drawn: [f64; 2]) -> [f64; 2] {
    let margin = SEARCH_RADIUS + (3.0 * BLUR_SIGMA) as usize;
    let [columns, rows]: [Range<usize>; 2] = [0, 1].map(|axis| {
        let at = drawn[axis].max(0.0) as usize;
        at.saturating_sub(margin)..(at + margin).min(data.size[axis])
    });
    let (wide, high) = (columns.len(), rows.len());
    let mut gradient2 = vec![0.0; wide * high];
    for channel in CHANNELS {
        let mut change = vec![0.0; wide * high];
        for (c, value) in change.iter_mut().enumerate() {
            let at = 3 * ((rows.start + c / wide) * data.size[0] + columns.start + c % wide) + channel;
            *value = f64::from(image[at]) - data.untouched[at];
        }
        let smooth = blur(&change, wide);
        for y in 1..high - 1 {
            for x in 1..wide - 1 {
                let c = y * wide + x;
                let (dx, dy) = (smooth[c + 1] - smooth[c - 1], smooth[c + wide] - smooth[c - wide]);
                gradient2[c] += dx * dx + dy * dy;
            }
        }
    }
    let greatest = gradient2.iter().copied().fold(0.0, f64::max);
    let near = gradient2.iter().enumerate().filter(|(_, t)| **t > CENTRE_SHARE * greatest);
    let [x, y, sum] = near.fold([0.0; 3], |[x, y, sum], (c, t)| {
        [x + t * (c % wide) as f64, y + t * (c / wide) as f64, sum + t]
    });
    [columns.start as f64 + x / sum, rows.start as f64 + y / sum]
}

/// Gaussian blur of rows of `wide` numbers; numbers outside count as zero.
fn blur(image: &[f64], wide: usize) -> Vec<f64> {
    let reach = (3.0 * BLUR_SIGMA) as isize;
    let weight = |k: isize| (-0.5 * (k as f64 / BLUR_SIGMA).powi(2)).exp();
    let total: f64 = (-reach..=reach).map(weight).sum();
    let pass = |image: &[f64], step: isize| -> Vec<f64> {
        let line = |c: usize| if step == 1 { c / wide } else { c % wide };
        (0..image.len())
            .map(|c| {
                let taps = (-reach..=reach).filter_map(|k| {
                    let at = usize::try_from(c as isize + k * step).ok()?;
                    (at < image.len() && line(at) == line(c)).then(|| weight(k) * image[at])
                });
                taps.sum::<f64>() / total
            })
            .collect()
    };
    pass(&pass(image, 1), wide as isize)
}

/// Pixels of a press within its circle, moved to `centre`.
fn samples(data: &Data, press: &Press, centre: [f64; 2], ball: Ball) -> Vec<Sample> {
    let [wide, high] = data.size;
    let mut samples = Vec::new();
    for (x, y) in (0..high).flat_map(|y| (0..wide).map(move |x| (x, y))) {
        let (dx, dy) = (x as f64 - centre[0], y as f64 - centre[1]);
        let far = dx.hypot(dy);
        if far >= press.radius {
            continue;
        }
        let per_px = ball.per_px.min(ball.steepest / far.max(1e-9));
        let at = 3 * (y * wide + x);
        samples.push(Sample {
            monomials: slope_monomials(dx * per_px, dy * per_px),
            pressed: CHANNELS.map(|c| f64::from(press.image[at + c])),
            untouched: CHANNELS.map(|c| data.untouched[at + c]),
        });
    }
    samples
}

/// Coefficients of each channel: their sum over the monomials, times the untouched image, is its change.
fn fit(samples: &[&Sample]) -> Option<[DVector<f64>; 3]> {
    let channel = |channel: usize| {
        let mut normal = DMatrix::identity(SLOPE_MONOMIALS, SLOPE_MONOMIALS) * (RIDGE * samples.len() as f64);
        let mut right = DVector::zeros(SLOPE_MONOMIALS);
        for sample in samples {
            let light = sample.untouched[channel];
            let f = DVector::from_row_slice(&sample.monomials) * light;
            normal.syger(1.0, &f, &f, 1.0);
            right.axpy(sample.pressed[channel] - light, &f, 1.0);
        }
        Some(normal.cholesky()?.solve(&right))
    };
    Some([channel(0)?, channel(1)?, channel(2)?])
}

/// Mean absolute error, of 255, of each fold of images under the fit to the other folds; `fold` maps an
/// index to its fold.
fn held_out_error(presses: &[Vec<Sample>], fold: impl Fn(usize) -> usize) -> f64 {
    let error = |out: usize| {
        let of = |left_out: bool| {
            let chosen = presses.iter().enumerate().filter(|(i, _)| (fold(*i) == out) == left_out);
            chosen.flat_map(|(_, press)| press).collect::<Vec<&Sample>>()
        };
        let (train, test) = (of(false), of(true));
        let Some(weights) = fit(&train) else { return f64::NAN };
        let mut sum = 0.0;
        for sample in &test {
            for (channel, weights) in weights.iter().enumerate() {
                let share: f64 = sample.monomials.iter().zip(weights.iter()).map(|(f, w)| f * w).sum();
                let found = (sample.untouched[channel] * (1.0 + share)).clamp(0.0, 255.0);
                sum += (found - sample.pressed[channel]).abs();
            }
        }
        sum / (3 * test.len()) as f64
    };
    (0..FOLDS).map(error).sum::<f64>() / FOLDS as f64
}

/// Cosine series of a channel of the untouched image.
fn cosine_series(data: &Data, channel: usize) -> [[f64; WAVES]; WAVES] {
    let [wide, high] = data.size;
    let wave = |n: usize, p: usize, of: usize| (PI * n as f64 * (p as f64 + 0.5) / of as f64).cos();
    let norm = |n: usize, of: usize| if n == 0 { 1.0 } else { 2.0 } / of as f64;
    let mut rows = vec![[0.0; WAVES]; high];
    for (y, row) in rows.iter_mut().enumerate() {
        for (i, sum) in row.iter_mut().enumerate() {
            let values =
                (0..wide).map(|x| data.untouched[3 * (y * wide + x) + CHANNELS[channel]] * wave(i, x, wide));
            *sum = norm(i, wide) * values.sum::<f64>();
        }
    }
    std::array::from_fn(|j| {
        std::array::from_fn(|i| {
            norm(j, high) * rows.iter().enumerate().map(|(y, row)| row[i] * wave(j, y, high)).sum::<f64>()
        })
    })
}
