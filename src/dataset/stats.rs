//! How actions, lengths and deformations of a data set are distributed.

use std::{fmt::Write, path::Path};

use serde::Serialize;

use super::{DatasetError, TaskFile};

/// Numbers of an action.
pub const ACTION_NAMES: [&str; 7] =
    ["x (m)", "y (m)", "z (m)", "turn x (rad)", "turn y (rad)", "turn z (rad)", "closure"];
/// Bars of a histogram.
const BARS: usize = 24;

/// One quantity over all demonstrations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ColumnStatistics {
    /// What it is.
    pub name: String,
    /// How many numbers there are.
    pub count: usize,
    /// The smallest.
    pub min: f64,
    /// The mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
    /// The middle one.
    pub median: f64,
    /// The largest.
    pub max: f64,
    /// How many are in each of equally wide bins from the smallest to the largest.
    pub bins: Vec<usize>,
}

impl ColumnStatistics {
    /// That of some numbers, of which there must be one.
    fn new(name: &str, mut numbers: Vec<f64>) -> Option<Self> {
        numbers.sort_by(f64::total_cmp);
        let (&min, &max) = (numbers.first()?, numbers.last()?);
        let count = numbers.len();
        let mean = numbers.iter().sum::<f64>() / count as f64;
        let sd = (numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count as f64).sqrt();
        let median = 0.5 * (numbers[(count - 1) / 2] + numbers[count / 2]);
        let mut bins = vec![0; BARS];
        for x in &numbers {
            let share = if max > min { (x - min) / (max - min) } else { 0.5 };
            bins[((share * BARS as f64) as usize).min(BARS - 1)] += 1;
        }
        Some(Self { name: name.to_owned(), count, min, mean, sd, median, max, bins })
    }
}

/// What is in some files.
///
/// # Errors
/// One of them cannot be read.
pub fn of(paths: &[impl AsRef<Path>]) -> Result<Vec<ColumnStatistics>, DatasetError> {
    let mut columns: [Vec<f64>; 7] = Default::default();
    let (mut lengths, mut peaks, mut soft) = (Vec::new(), Vec::new(), Vec::new());
    for path in paths {
        let file = TaskFile::open(path.as_ref())?;
        for &demo in file.demos() {
            let actions = file.actions(demo)?;
            lengths.push(actions.len() as f64);
            for a in &actions {
                let row = a.position_b.iter().chain(a.axis_angle_b.iter()).chain([&a.closure]);
                columns.iter_mut().zip(row).for_each(|(column, x)| column.push(*x));
            }
            peaks.extend(file.record(demo).ok().and_then(|record| record.verdict.d_peak));
            // Those without privileged streams, and of rigid targets, have none.
            if let Ok((d, _)) = file.doubles(demo, "privileged/soft_extras/fem_deformation_rms") {
                soft.extend(d);
            }
        }
    }
    let named = ACTION_NAMES.into_iter().zip(columns);
    let all = [("length (steps)", lengths), ("peak D (%)", peaks), ("D (%)", soft)].into_iter().chain(named);
    Ok(all.filter_map(|(name, numbers)| ColumnStatistics::new(name, numbers)).collect())
}

/// The numbers as a table.
pub fn table(spreads: &[ColumnStatistics]) -> String {
    let mut text = format!(
        "{:<16}{:>9}{:>10}{:>10}{:>10}{:>10}{:>10}\n",
        "", "count", "min", "median", "mean", "sd", "max"
    );
    for s in spreads {
        // Writing into a string cannot fail.
        let _ = writeln!(
            text,
            "{:<16}{:>9}{:>10.3}{:>10.3}{:>10.3}{:>10.3}{:>10.3}",
            s.name, s.count, s.min, s.median, s.mean, s.sd, s.max
        );
    }
    text
}

/// Width and height of a histogram with its words, and how many stand side by side.
const CELL: [usize; 2] = [260, 160];
const ACROSS: usize = 4;

/// The histograms as a picture.
pub fn svg(spreads: &[ColumnStatistics]) -> String {
    let rows = spreads.len().div_ceil(ACROSS);
    let [width, height] = CELL;
    let mut page = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        ACROSS * width,
        rows * height
    );
    for (at, s) in spreads.iter().enumerate() {
        let (x, y) = (at % ACROSS * width + 20, at / ACROSS * height + 24);
        let _ = writeln!(page, "<text x=\"{x}\" y=\"{y}\" font-weight=\"bold\">{}</text>", s.name);
        let most = s.bins.iter().copied().max().unwrap_or(1).max(1) as f64;
        let bar = (width - 40) as f64 / BARS as f64;
        for (i, count) in s.bins.iter().enumerate() {
            let high = (height - 64) as f64 * *count as f64 / most;
            let left = x as f64 + bar * i as f64;
            let top = (y + height - 56) as f64 - high;
            let _ = writeln!(
                page,
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{high:.1}\" fill=\"#3b7dd8\"/>",
                bar - 1.0
            );
        }
        let under = y + height - 42;
        let _ = writeln!(page, "<text x=\"{x}\" y=\"{under}\" fill=\"#555\">{:.3}</text>", s.min);
        let right = x + width - 40;
        let _ = writeln!(
            page,
            "<text x=\"{right}\" y=\"{under}\" fill=\"#555\" text-anchor=\"end\">{:.3}</text>",
            s.max
        );
    }
    page + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_says_what_the_numbers_say() {
        let s = ColumnStatistics::new("x", vec![4.0, 1.0, 2.0, 3.0]).unwrap();
        assert_eq!((s.count, s.min, s.median, s.mean, s.max), (4, 1.0, 2.5, 2.5, 4.0));
        assert!((s.sd - 1.25_f64.sqrt()).abs() < 1e-12);
        assert_eq!((s.bins[0], s.bins[BARS - 1], s.bins.iter().sum::<usize>()), (1, 1, 4));
        assert_eq!(ColumnStatistics::new("none", Vec::new()), None);
        let page = svg(&[s]);
        assert!(page.starts_with("<svg") && page.matches("<rect").count() == BARS + 1, "{page}");
    }
}
