//! Numbers in the cells of tables.

use softvt_common::text::decimal;
use softvt_evaluation::statistics::{Distribution, Rate};
use softvt_runs::summary::TauRange;

/// A rate with its interval; "N/A" for none, such as Safety of rigid suites and what was never judged.
pub(crate) fn rate(rate: &Rate) -> String {
    let bounds = rate.wilson95.map(|[low, high]| format!(" [{low:.1}, {high:.1}]")).unwrap_or_default();
    rate.rate.map_or_else(|| "N/A".to_owned(), |value| format!("{value:.1}{bounds}"))
}

/// A percentile of D, with two decimals; "∞" if it falls on an invalid episode.
pub(crate) fn percentile(of: &Distribution, value: Option<f64>) -> String {
    if value.is_none() && of.has_invalid() { "∞".to_owned() } else { decimal(value, 2) }
}

/// The τ that was applied, or the range of several; empty without any.
pub(crate) fn tau_range(range: Option<TauRange>) -> String {
    let Some(TauRange { min, max }) = range else { return String::new() };
    let [min, max] = [min, max].map(|tau| format!("{tau:.2}"));
    if min == max { min } else { format!("{min}–{max}") }
}

/// A p-value with three decimals, without the zero before them.
pub(crate) fn probability(p: f64) -> String {
    match p {
        p if p < 0.001 => "<.001".to_owned(),
        p if p > 0.9995 => "1".to_owned(),
        p => format!("{p:.3}").trim_start_matches('0').to_owned(),
    }
}

pub(crate) fn signed(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:+.digits$}").replace('-', "−"))
}

pub(crate) fn interval(bounds: Option<[f64; 2]>, digits: usize) -> String {
    bounds.map_or_else(
        || "–".to_owned(),
        |[low, high]| format!("[{}, {}]", signed(Some(low), digits), signed(Some(high), digits)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_probabilities_are_bounds() {
        assert_eq!([0.25, 0.001, 0.0009, 0.0].map(probability), [".250", ".001", "<.001", "<.001"]);
    }

    #[test]
    fn the_cell_of_tau_shows_what_was_applied() {
        let shown = |min: f64, max: f64| tau_range(Some(TauRange { min, max }));
        assert_eq!((shown(2.5, 2.5), shown(1.018, 3.09)), ("2.50".to_owned(), "1.02–3.09".to_owned()));
        assert_eq!(tau_range(None), "");
    }
}
