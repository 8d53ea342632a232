//! How two runs differ, as rows of plain text: one layout for `softvt compare` and for conditions.

use std::fmt::Write;

use crate::evaluation::paired_stats::{MeanDifference, PairedComparison, RateDifference};

/// Columns of the name at the left.
const NAME: usize = 29;
/// Columns of a whole row.
pub(super) const WIDTH: usize = 99;

/// What the rows say, to be written once below them.
pub(super) const KEY: &str = "difference: second minus first · 95 % intervals: Agresti and Min for rates, bootstrap for D\nbetter, worse: episodes; of D, less is better · p: McNemar's exact test";

/// Which deformation is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Deformation {
    /// Nothing deforms.
    None,
    /// Peak D, % of the diagonal.
    Peak,
    /// Peak D over τ.
    OverTau,
}

/// The heads of the columns.
pub(super) fn head(name: &str, [first, second]: [&str; 2]) -> String {
    cells(name, ["", first, second, "differ.", "95 % interval", "better", "worse", "p"].map(str::to_owned))
}

/// A row a measure, the first with the name.
pub(super) fn rows(name: &str, of: &PairedComparison, deformation: Deformation) -> Vec<String> {
    let mut all =
        vec![rate("Goal, %", &of.goal), rate("NoDrop, %", &of.no_drop), rate("Safety, %", &of.safety)];
    match deformation {
        Deformation::None => {}
        Deformation::Peak => all.push(mean("D peak, %", &of.d_peak)),
        Deformation::OverTau => all.push(mean("D peak/τ", &of.d_over_tau)),
    }
    let names = [name].into_iter().chain(std::iter::repeat(""));
    all.into_iter().zip(names).map(|(row, name)| cells(name, row)).collect()
}

fn rate(measure: &str, of: &RateDifference) -> [String; 8] {
    [
        measure.to_owned(),
        plain(of.first, 1),
        plain(of.second, 1),
        signed(of.difference, 1),
        interval(of.interval95, 1),
        of.better.to_string(),
        of.worse.to_string(),
        format!("{:.3}", of.p),
    ]
}

fn mean(measure: &str, of: &MeanDifference) -> [String; 8] {
    [
        measure.to_owned(),
        plain(of.first, 2),
        plain(of.second, 2),
        signed(of.difference, 2),
        interval(of.interval95, 2),
        of.better.to_string(),
        of.worse.to_string(),
        String::new(),
    ]
}

fn plain(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

fn signed(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:+.digits$}"))
}

fn interval(of: Option<[f64; 2]>, digits: usize) -> String {
    of.map_or_else(|| "–".to_owned(), |[low, high]| format!("[{low:+.digits$}, {high:+.digits$}]"))
}

fn cells(name: &str, cells: [String; 8]) -> String {
    let mut text = format!("{:<NAME$}", shortened(name, NAME));
    let [measure, rest @ ..] = cells;
    // Writing to a String cannot fail.
    let _ = write!(text, " {measure:<9}");
    for (cell, width) in rest.iter().zip([7, 8, 8, 18, 7, 6, 6]) {
        let _ = write!(text, "{cell:>width$}");
    }
    text.trim_end().to_owned()
}

/// At most `width` letters of a text, on one line.
pub(super) fn shortened(text: &str, width: usize) -> String {
    let text = text.replace('\n', " ");
    if text.chars().count() <= width {
        return text;
    }
    text.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}
