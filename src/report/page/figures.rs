//! Figures of the report. Names and numbers are text, which wraps; the marks next to them are SVG with coordinates
//! in percent of the width, so that text does not shrink on narrow screens. Colours come from the style sheet, for
//! light and dark schemes.

use maud::{Markup, Render, html};

use crate::{
    condition_effects::{ConditionEffects, FactorTrend, TrendPoint},
    run_summary::RunSummary,
};
use softvt_common::text::{shortened, significant};
use softvt_evaluation::statistics::{Distribution, Rate};
use softvt_records::{paired_stats::d_over_tau, record::EpisodeRecord};

/// Height of a bar, and distance between bars, pixels.
const BAR_HEIGHT: f64 = 12.0;
const BAR_PITCH: f64 = 15.0;
/// Height of a strip of dots, pixels.
const STRIP_HEIGHT: f64 = 30.0;
/// Height of the plot of curves, pixels.
const PLOT_HEIGHT: f64 = 240.0;
/// Ends of the logarithmic axis of D/τ, the same for all strips. Values beyond are arrows at its ends.
const D_OVER_TAU: [f64; 2] = [0.05, 50.0];
/// Labelled values of that axis.
const D_TICKS: [f64; 6] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0];

/// Place of D/τ on the axis, 0 to 1 within its ends.
fn d_share(d_over_tau: f64) -> f64 {
    (d_over_tau.max(f64::MIN_POSITIVE) / D_OVER_TAU[0]).ln() / (D_OVER_TAU[1] / D_OVER_TAU[0]).ln()
}

/// Coordinate at a fraction of the width.
fn x(fraction: f64) -> String {
    format!("{:.2}%", 100.0 * fraction.clamp(0.0, 1.0))
}

fn y(at: f64) -> String {
    format!("{at:.1}")
}

/// Goal and Safety Success: a pair of bars per run, with intervals.
pub(super) fn goal_and_safety(runs: &[RunSummary]) -> Markup {
    html! {
        p.legend {
            span.key { (swatch("goal")) "Goal Success" }
            span.key { (swatch("safety")) "Safety Success" }
        }
        div.chart {
            @for runs in runs.chunk_by(|a, b| a.summary.suite == b.summary.suite) {
                p.suite { (runs[0].summary.suite) }
                @for run in runs { (bar_row(run)) }
            }
            (axis(&["0", "25", "50", "75", "100 %"]))
        }
    }
}

fn bar_row(run: &RunSummary) -> Markup {
    let goal = run.summary.scores.goal_success_rate;
    let safety = run.is_soft().then_some(run.summary.scores.safety_success_rate);
    let quarters = (0..=4).map(|i| f64::from(i) / 4.0);
    html! {
        div.row {
            span.name { (run.method) }
            svg width="100%" height=(2.0 * BAR_PITCH) aria-hidden="true" {
                (vertical_lines("grid", quarters))
                (bar("goal", Some(goal), 1.0))
                (bar("safety", safety, 1.0 + BAR_PITCH))
            }
            span.value {
                (percent(goal)) br;
                (safety.map_or_else(|| "N/A".to_owned(), percent))
            }
        }
    }
}

/// Vertical lines over the full height, at fractions of the width.
fn vertical_lines(class: &str, at: impl Iterator<Item = f64>) -> Markup {
    html! { @for at in at { line class=(class) x1=(x(at)) x2=(x(at)) y1="0" y2="100%" {} } }
}

fn percent(rate: Rate) -> String {
    rate.rate.map_or_else(|| "–".to_owned(), |rate| format!("{rate:.1} %"))
}

fn swatch(class: &str) -> Markup {
    html! { svg.swatch width="12" height="12" aria-hidden="true" { rect class=(class) width="12" height="12" rx="2" {} } }
}

fn bar(class: &str, rate: Option<Rate>, top: f64) -> Markup {
    let middle = top + 0.5 * BAR_HEIGHT;
    html! {
        @if let Some((value, [low, high])) = rate.and_then(|rate| rate.rate.zip(rate.wilson95)) {
            rect class=(class) x="0" y=(y(top)) width=(x(value / 100.0)) height=(BAR_HEIGHT) rx="2" {}
            line.interval x1=(x(low / 100.0)) x2=(x(high / 100.0)) y1=(y(middle)) y2=(y(middle)) {}
            @for end in [low, high] {
                line.interval x1=(x(end / 100.0)) x2=(x(end / 100.0)) y1=(y(middle - 3.0)) y2=(y(middle + 3.0)) {}
            }
        } @else {
            text.tick x="4" y=(y(top + 0.5 * BAR_HEIGHT + 4.0)) { @if rate.is_some() { "–" } @else { "N/A" } }
        }
    }
}

/// Evenly spaced labels below a column of strips.
fn axis(labels: &[impl Render]) -> Markup {
    let last = labels.len().saturating_sub(1);
    html! {
        div.row.axis {
            span.name {}
            svg width="100%" height="18" aria-hidden="true" {
                @for (i, label) in labels.iter().enumerate() { (tick(i, last, "13", label)) }
            }
            span.value {}
        }
    }
}

/// The i-th label of an axis from 0 to `last`.
fn tick(i: usize, last: usize, y: &str, label: impl Render) -> Markup {
    let anchor = if i == 0 {
        "start"
    } else if i == last {
        "end"
    } else {
        "middle"
    };
    html! { text.tick x=(x(i as f64 / last.max(1) as f64)) y=(y) text-anchor=(anchor) { (label) } }
}

/// A strip of dots, one per episode.
struct Strip<'a> {
    /// Heading above the strips of one suite; empty for none.
    suite: &'a str,
    name: &'a str,
    dots: Vec<Dot>,
}

struct Dot {
    d_over_tau: f64,
    reached_goal: bool,
}

impl<'a> Strip<'a> {
    /// Episodes of a run, or only those with the target `asset`.
    fn new(suite: &'a str, name: &'a str, run: &RunSummary, asset: Option<&str>) -> Self {
        let records = run.run.records.iter();
        let selected = records.filter(|r| asset.is_none_or(|asset| r.header.asset == asset));
        let dot = |r| Some(Dot { d_over_tau: d_over_tau(r)?, reached_goal: r.verdict.goal });
        Self { suite, name, dots: selected.filter_map(dot).collect() }
    }
}

/// Peak deformation divided by its threshold: one strip per run.
pub(super) fn distributions(runs: &[RunSummary]) -> Markup {
    let soft = runs.iter().filter(|run| run.is_soft());
    let strips = soft.map(|run| Strip::new(&run.summary.suite, &run.method, run, None));
    strip_chart(&strips.collect::<Vec<_>>())
}

/// The same for one run: one strip per object.
pub(super) fn by_asset(run: &RunSummary) -> Markup {
    let strips = run.summary.by_asset.keys().map(|asset| Strip::new("", asset, run, Some(asset)));
    strip_chart(&strips.collect::<Vec<_>>())
}

fn strip_chart(strips: &[Strip]) -> Markup {
    html! {
        div.chart {
            @for strips in strips.chunk_by(|a, b| a.suite == b.suite) {
                @if !strips[0].suite.is_empty() { p.suite { (strips[0].suite) } }
                @for strip in strips { (strip_row(strip)) }
            }
            div.row.axis {
                span.name {}
                svg width="100%" height="18" aria-hidden="true" {
                    @for tick in D_TICKS {
                        text.tick x=(x(d_share(tick))) y="13" text-anchor="middle" { @if tick == 1.0 { "limit τ" } @else { (tick) " ×" } }
                    }
                }
                span.value {}
            }
        }
    }
}

fn strip_row(strip: &Strip) -> Markup {
    let distribution = Distribution::from_values(strip.dots.iter().map(|dot| dot.d_over_tau).collect());
    let median = distribution.median.map_or_else(|| "no D".to_owned(), |m| format!("median {m:.2}"));
    html! {
        div.row {
            span.name { (strip.name) }
            svg width="100%" height=(STRIP_HEIGHT) aria-hidden="true" {
                (vertical_lines("grid", D_TICKS.into_iter().map(d_share)))
                (vertical_lines("limit", std::iter::once(d_share(1.0))))
                (distribution_mark(&distribution))
                @for (k, dot) in strip.dots.iter().enumerate() { (dot_mark(dot, k)) }
            }
            span.value { (median) br; "n " (distribution.n) }
        }
    }
}

/// The k-th dot of a strip, offset vertically so that equal values stay apart.
fn dot_mark(dot: &Dot, k: usize) -> Markup {
    let class = if dot.reached_goal { "dot" } else { "dot failed" };
    let offset = (((k * 5) % 9) as f64 - 4.0) * 2.4;
    let (at, height) = (d_share(dot.d_over_tau), 0.5 * STRIP_HEIGHT + offset);
    html! {
        @if (0.0..=1.0).contains(&at) { circle class=(class) cx=(x(at)) cy=(y(height)) r="3" {} }
        @else { text.beyond x=(x(at)) y=(y(height + 4.0)) text-anchor=(if at > 1.0 { "end" } else { "start" }) { (if at > 1.0 { "▶" } else { "◀" }) } }
    }
}

/// P5 to P95, and the median.
fn distribution_mark(of: &Distribution) -> Markup {
    let middle = y(0.5 * STRIP_HEIGHT);
    html! {
        @if let Some((low, high)) = of.p5.zip(of.p95) {
            line.spread x1=(x(d_share(low))) x2=(x(d_share(high))) y1=(middle) y2=(middle) {}
        }
        @if let Some(median) = of.median {
            line.median x1=(x(d_share(median))) x2=(x(d_share(median))) y1="4" y2=(y(STRIP_HEIGHT - 4.0)) {}
        }
    }
}

/// Goal and Safety Success over the values of each factor: one plot per factor, side by side.
pub(super) fn trends(suite: &ConditionEffects) -> Markup {
    html! {
        p.legend { @for series in SERIES { span.key { (series_swatch(&series)) (series.name) } } }
        div.panels {
            @for trend in suite.trends() {
                div {
                    p.suite { (trend.factor) }
                    (trend_plot(&trend, suite.reference()))
                }
            }
        }
    }
}

/// A rate in the plots of trends.
struct Series {
    class: &'static str,
    name: &'static str,
    rate: fn(&TrendPoint) -> Rate,
    /// Corner radius of the marks, px: round or nearly square.
    mark_radius: f64,
    /// Shift of lines and marks, px, so that equal rates stay apart.
    shift: [f64; 2],
}

const SERIES: [Series; 2] = [
    Series {
        class: "series goal",
        name: "Goal Success",
        rate: |point| point.goal,
        mark_radius: 0.5 * MARK,
        shift: [-4.0, -1.5],
    },
    Series {
        class: "series safety",
        name: "Safety Success",
        rate: |point| point.safety,
        mark_radius: 1.0,
        shift: [4.0, 1.5],
    },
];

/// Edge length of a mark, px.
const MARK: f64 = 8.0;
/// Ratio of the largest to the smallest value from which an axis is logarithmic.
const LOG_RATIO: f64 = 20.0;
/// Largest length of a factor's name at its axis.
const MAX_AXIS_NAME: usize = 30;
/// Smallest distance of labelled values, as a fraction of the width.
const LABEL_DISTANCE: f64 = 0.14;

fn series_swatch(series: &Series) -> Markup {
    html! {
        svg.swatch width="30" height="12" aria-hidden="true" {
            g class=(series.class) {
                line x1="1" x2="29" y1="6" y2="6" {}
                (mark(series, "50%", 6.0))
            }
        }
    }
}

fn mark(series: &Series, at: &str, height: f64) -> Markup {
    let offset = format!("translate({} {})", -0.5 * MARK, -0.5 * MARK);
    html! { rect x=(at) y=(y(height)) width=(MARK) height=(MARK) rx=(series.mark_radius) transform=(offset) {} }
}

fn trend_plot(trend: &FactorTrend, reference: [Option<f64>; 2]) -> Markup {
    let points = &trend.points;
    let (low, high) = (points[0].value, points[points.len() - 1].value);
    let is_log = low > 0.0 && high / low >= LOG_RATIO;
    let scale = |value: f64| if is_log { value.ln() } else { value };
    let extent = (scale(high) - scale(low)).max(f64::MIN_POSITIVE);
    // The ends stay clear of the borders, where the labels would be cut off.
    let at = |value: f64| 0.08 + 0.84 * (scale(value) - scale(low)) / extent;
    let name = shortened(&trend.factor, MAX_AXIS_NAME);
    let mut labelled: Vec<f64> = Vec::new();
    for TrendPoint { value, .. } in points {
        if labelled.last().is_none_or(|last| at(*value) - at(*last) >= LABEL_DISTANCE) {
            labelled.push(*value);
        }
    }
    let label = format!("Goal and Safety Success over {}; the numbers are in the table above", trend.factor);
    html! {
        div.axes {
            (rate_axis(40.0))
            svg.plot width="100%" height=(PLOT_HEIGHT + 40.0) role="img" aria-label=(label) {
                (rate_grid())
                @for (series, reference) in SERIES.iter().zip(reference) { (trend_series(series, points, at, reference)) }
                @for value in labelled {
                    text.tick x=(x(at(value))) y=(y(PLOT_HEIGHT + 16.0)) text-anchor="middle" { (significant(value, 3)) }
                }
                text.tick x="50%" y=(y(PLOT_HEIGHT + 34.0)) text-anchor="middle" {
                    "value of " (name) @if is_log { ", log scale" }
                }
            }
        }
    }
}

/// The line of the reference, and the rate at each value with its interval.
fn trend_series(
    series: &Series,
    points: &[TrendPoint],
    at: impl Fn(f64) -> f64,
    reference: Option<f64>,
) -> Markup {
    let [right, down] = series.shift;
    let rates: Vec<(String, f64, [f64; 2])> = points
        .iter()
        .filter_map(|point| {
            let rate = (series.rate)(point);
            Some((x(at(point.value)), level(rate.rate?), rate.wilson95?.map(level)))
        })
        .collect();
    html! {
        @if let Some(height) = reference.map(|rate| y(level(rate) + down)) {
            g class=(series.class) { line.reference x1="0" x2="100%" y1=(height) y2=(height) {} }
        }
        g class=(series.class) transform=(format!("translate({right} {down})")) {
            @for pair in rates.windows(2) { line x1=(pair[0].0) x2=(pair[1].0) y1=(y(pair[0].1)) y2=(y(pair[1].1)) {} }
            @for (at, height, [low, high]) in &rates {
                line.whisker x1=(at) x2=(at) y1=(y(*low)) y2=(y(*high)) {}
                (mark(series, at, *height))
            }
        }
    }
}

/// Labels of rates left of a plot; `below` is the height of what is below the plot, px.
fn rate_axis(below: f64) -> Markup {
    html! {
        svg width="100%" height=(PLOT_HEIGHT + below) aria-hidden="true" {
            @for percent in [0, 25, 50, 75, 100] {
                text.tick x="100%" y=(y(level(f64::from(percent)) + 4.0)) text-anchor="end" { (percent) " %" }
            }
        }
    }
}

/// Horizontal lines at the rates of [`rate_axis`].
fn rate_grid() -> Markup {
    let heights = (0..=4).map(|quarter| y(level(25.0 * f64::from(quarter))));
    html! { @for height in heights { line.grid x1="0" x2="100%" y1=(height) y2=(height) {} } }
}

/// Safety Success over the strictness of the thresholds: one plot per suite, one line per run.
pub(super) fn kappa_curves(runs: &[RunSummary]) -> Markup {
    let soft: Vec<&RunSummary> = runs.iter().filter(|run| run.is_soft()).collect();
    html! {
        @for runs in soft.chunk_by(|a, b| a.summary.suite == b.summary.suite) {
            p.suite { (runs[0].summary.suite) }
            (kappa_plot(&runs[0].summary.suite, runs))
            p.legend { @for (i, run) in runs.iter().enumerate() { (curve_key(run, i)) } }
        }
    }
}

fn kappa_plot(suite: &str, runs: &[&RunSummary]) -> Markup {
    let label = format!("Safety Success over kappa, {suite}; the numbers are in the table above");
    html! {
        div.axes {
            (rate_axis(22.0))
            svg.plot width="100%" height=(PLOT_HEIGHT + 22.0) role="img" aria-label=(label) {
                (rate_grid())
                line.limit x1="50%" x2="50%" y1=(y(level(100.0))) y2=(y(level(0.0))) {}
                @for (i, run) in runs.iter().enumerate() { (curve(run, i)) }
                @for (i, label) in ["κ = 0", "0.2", "0.4", "0.6", "0.8", "1"].iter().enumerate() {
                    (tick(i, 5, &y(PLOT_HEIGHT + 16.0), label))
                }
            }
        }
    }
}

fn curve_key(run: &RunSummary, index: usize) -> Markup {
    html! {
        span.key {
            svg.swatch width="30" height="12" aria-hidden="true" {
                line class=(style(index)) x1="1" x2="29" y1="6" y2="6" {}
            }
            (run.method)
        }
    }
}

/// Height of a rate in the plot of curves.
fn level(percent: f64) -> f64 {
    let top = 8.0;
    top + (PLOT_HEIGHT - top) * (1.0 - percent / 100.0)
}

/// Six colours, repeated with dashes.
fn style(index: usize) -> String {
    format!("curve c{} d{}", index % 6, index / 6 % 4)
}

/// A point of the curve of Safety Success over κ.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CurvePoint {
    kappa: f64,
    percent: f64,
}

/// The corners of the curve. Safety Success is a step function of κ: it rises where κ reaches D_peak / D_ref of an
/// episode. Empty if nothing was judged.
fn curve_corners(run: &RunSummary) -> Vec<CurvePoint> {
    if run.summary.kappa.iter().all(|row| row.safety_success_rate.rate.is_none()) {
        return Vec::new();
    }
    let records = &run.run.records;
    let safe_from = |record: &EpisodeRecord| {
        let v = &record.verdict;
        if !(record.outcome.is_valid() && v.goal && v.no_drop && v.missing_deformation == 0) {
            return None;
        }
        if record.header.soft { v.d_peak.zip(v.d_ref).map(|(d, d_ref)| d / d_ref) } else { Some(0.0) }
    };
    let mut steps: Vec<f64> = records.iter().filter_map(safe_from).filter(|kappa| *kappa <= 1.0).collect();
    steps.sort_by(f64::total_cmp);
    let percent = |count: usize| 100.0 * count as f64 / records.len().max(1) as f64;
    let mut corners = vec![CurvePoint { kappa: 0.0, percent: 0.0 }];
    for (count, kappa) in steps.into_iter().enumerate() {
        corners.extend([count, count + 1].map(|count| CurvePoint { kappa, percent: percent(count) }));
    }
    let last = corners[corners.len() - 1];
    corners.push(CurvePoint { kappa: 1.0, ..last });
    corners
}

fn curve(run: &RunSummary, index: usize) -> Markup {
    let corners = curve_corners(run);
    // Separates coinciding lines.
    let offset = 1.5 * ((index % 5) as f64 - 2.0);
    html! {
        g class=(style(index)) {
            @for pair in corners.windows(2) {
                line x1=(x(pair[0].kappa)) x2=(x(pair[1].kappa)) y1=(y(level(pair[0].percent) + offset)) y2=(y(level(pair[1].percent) + offset)) {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        run_summary::{summarize_runs, tests::stored},
        sample_record,
    };

    #[test]
    fn the_curve_of_strictness_is_a_step_function() {
        // D_ref is 2: safe from κ 0.225 and from κ 0.8.
        let records = [0.45, 1.6, 9.0].map(|d| {
            let mut record = sample_record();
            record.header.id.episode = (10.0 * d) as u32;
            record.verdict.d_peak = Some(d);
            record
        });
        let runs = summarize_runs(vec![stored("a", "pi", records.to_vec())]);
        let corners = curve_corners(&runs[0]);
        let level = |step: usize| 100.0 * step as f64 / 3.0;
        let expected = [(0.0, 0), (0.225, 0), (0.225, 1), (0.8, 1), (0.8, 2), (1.0, 2)]
            .map(|(kappa, step)| CurvePoint { kappa, percent: level(step) });
        assert_eq!(corners, expected);
        let rises = |pair: &[CurvePoint]| pair[0].percent != pair[1].percent;
        assert!(corners.windows(2).filter(|pair| rises(pair)).all(|pair| pair[0].kappa == pair[1].kappa));
    }
}
