//! Distributions of actions, lengths and deformations in a dataset.

use std::path::Path;

use serde::Serialize;

use super::{DatasetError, TaskFile, streams};
use softvt_benchmark::CONTROL_DT;
use softvt_common::{
    table::{Column, Table},
    text::decimal,
};
use softvt_media::{
    axis::Axis,
    chart::{Chart, Layout, Margins, Mark},
};
use softvt_policy::Action;

const ACTION_NAMES: [&str; 7] =
    ["x (m)", "y (m)", "z (m)", "turn x (rad)", "turn y (rad)", "turn z (rad)", "closure"];
const BINS: usize = 24;

/// Distribution of one quantity over all demonstrations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ColumnStatistics {
    /// Name with its unit.
    pub name: String,
    pub count: usize,
    pub min: f64,
    pub mean: f64,
    pub sd: f64,
    pub median: f64,
    pub max: f64,
    /// Counts in bins of equal width from `min` to `max`.
    pub bins: Vec<usize>,
}

impl ColumnStatistics {
    /// `None` if there are no numbers.
    fn new(name: &str, mut numbers: Vec<f64>) -> Option<Self> {
        numbers.sort_by(f64::total_cmp);
        let (&min, &max) = (numbers.first()?, numbers.last()?);
        let count = numbers.len();
        let mean = numbers.iter().sum::<f64>() / count as f64;
        let sd = (numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count as f64).sqrt();
        let median = 0.5 * (numbers[(count - 1) / 2] + numbers[count / 2]);
        let mut bins = vec![0; BINS];
        for x in &numbers {
            let share = if max > min { (x - min) / (max - min) } else { 0.5 };
            bins[((share * BINS as f64) as usize).min(BINS - 1)] += 1;
        }
        Some(Self { name: name.to_owned(), count, min, mean, sd, median, max, bins })
    }
}

/// Statistics of the actions, lengths and deformations in HDF5 files.
pub fn column_statistics(paths: &[impl AsRef<Path>]) -> Result<Vec<ColumnStatistics>, DatasetError> {
    let mut columns: [Vec<f64>; 7] = Default::default();
    let (mut lengths, mut peaks, mut soft, mut speeds) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for path in paths {
        let file = TaskFile::open(path.as_ref())?;
        for &demo in &file.demos {
            let actions: Vec<[f64; 7]> =
                streams::continuous(&file.actions(demo)?).map(Action::to_array).collect();
            lengths.push(actions.len() as f64);
            speeds.extend(actions.windows(2).map(|pair| commanded_speed(pair[0], pair[1])));
            for action in actions {
                columns.iter_mut().zip(action).for_each(|(column, x)| column.push(x));
            }
            peaks.extend(file.record(demo).ok().and_then(|record| record.d_peak()));
            // Missing for rigid targets and without privileged streams.
            if let Ok(d) = file.array(demo, streams::DEFORMATION) {
                soft.extend(d.values);
            }
        }
    }
    let named = ACTION_NAMES.into_iter().zip(columns);
    let all = [("length (steps)", lengths), ("peak D (%)", peaks), ("D (%)", soft), ("speed (m/s)", speeds)];
    let all = all.into_iter().chain(named);
    Ok(all.filter_map(|(name, numbers)| ColumnStatistics::new(name, numbers)).collect())
}

/// Speed of the commanded tool from one action to the next, m/s.
fn commanded_speed(from: [f64; 7], to: [f64; 7]) -> f64 {
    let squares = (0..3).map(|axis| (to[axis] - from[axis]).powi(2));
    squares.sum::<f64>().sqrt() / CONTROL_DT
}

pub fn table(statistics: &[ColumnStatistics]) -> String {
    let number = |name, of: fn(&ColumnStatistics) -> f64| {
        Column::number(name, move |s: &ColumnStatistics| decimal(Some(of(s)), 3)).width(9)
    };
    let columns = [
        Column::text("", |s: &ColumnStatistics| s.name.clone()).width(16),
        Column::number("count", |s: &ColumnStatistics| s.count.to_string()).width(8),
        number("min", |s| s.min),
        number("median", |s| s.median),
        number("mean", |s| s.mean),
        number("sd", |s| s.sd),
        number("max", |s| s.max),
    ];
    Table::new(statistics, columns).text()
}

const PANELS: Layout = Layout {
    columns: 4,
    panel: [280.0, 190.0],
    margins: Margins { left: 52.0, top: 28.0, right: 16.0, bottom: 38.0 },
    shared: None,
    unit: 1.0,
};

pub fn svg(columns: &[ColumnStatistics]) -> String {
    let histogram = |s: &ColumnStatistics| {
        // All values may be equal.
        let (min, max) = if s.max > s.min { (s.min, s.max) } else { (s.min - 0.5, s.max + 0.5) };
        Chart {
            title: s.name.clone(),
            x: Axis::linear("", min, max, 4),
            y: Axis::counts(&s.bins, 3).with_grid(),
            marks: vec![Mark::Bars(s.bins.clone())],
        }
    };
    let names: Vec<&str> = columns.iter().map(|s| s.name.as_str()).collect();
    let label = format!("Histograms of {}", names.join(", "));
    PANELS.svg(&label, &columns.iter().map(histogram).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_four_numbers_are_those_computed_by_hand() {
        let s = ColumnStatistics::new("x", vec![4.0, 1.0, 2.0, 3.0]).unwrap();
        assert_eq!((s.count, s.min, s.median, s.mean, s.max), (4, 1.0, 2.5, 2.5, 4.0));
        assert!((s.sd - 1.25_f64.sqrt()).abs() < 1e-12);
        assert_eq!((s.bins[0], s.bins[BINS - 1], s.bins.iter().sum::<usize>()), (1, 1, 4));
        let at = |x: f64, z: f64| [x, 0.0, z, 0.0, 0.0, 0.0, 0.0];
        assert!((commanded_speed(at(0.0, 0.0), at(0.03, 0.04)) - 0.05 / CONTROL_DT).abs() < 1e-12);
        assert_eq!(ColumnStatistics::new("none", Vec::new()), None);
        let constant = ColumnStatistics::new("c", vec![2.0; 3]).unwrap();
        let page = svg(&[s, constant]);
        assert!(page.starts_with("<svg") && page.matches("class=\"bar\"").count() == 5, "{page}");
        assert!(page.contains(">2.0<") && !page.contains("NaN"), "{page}");
    }
}
