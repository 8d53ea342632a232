//! The figures of a report. Names and numbers are text of the page, which wraps; beside them are strips of SVG in shares of
//! their width, so that nothing shrinks on a narrow screen. Colours come from the page and follow light and dark.

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::{
    evaluation::{
        paired_stats::d_over_tau,
        statistics::{Distribution, Rate},
    },
    report::run_summary::RunSummary,
};

/// Height of a bar, and from one to the next, pixels.
const BAR: f64 = 12.0;
const PITCH: f64 = 15.0;
/// Height of a strip of dots, pixels.
const STRIP: f64 = 30.0;
/// Height of the plot of curves, pixels.
const PLOT: f64 = 240.0;
/// D/τ beyond which dots are put at the edge.
const MOST_TAU: f64 = 6.0;

/// A share of the width.
fn x(share: f64) -> String {
    format!("{:.2}%", 100.0 * share.clamp(0.0, 1.0))
}

fn y(at: f64) -> String {
    format!("{at:.1}")
}

fn short(number: f64) -> String {
    let text = format!("{number:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Runs by suite, in order.
fn by_suite<'a>(runs: impl Iterator<Item = &'a RunSummary>) -> BTreeMap<&'a str, Vec<&'a RunSummary>> {
    let mut suites: BTreeMap<&str, Vec<&RunSummary>> = BTreeMap::new();
    runs.for_each(|judged| suites.entry(&judged.summary.suite).or_default().push(judged));
    suites
}

/// Goal and Safety Success, a pair of bars a run, with their intervals.
pub(super) fn goal_and_safety(runs: &[RunSummary]) -> Markup {
    html! {
        p.legend {
            span.key { (swatch("goal")) "Goal Success" }
            span.key { (swatch("safety")) "Safety Success" }
        }
        div.chart {
            @for (suite, runs) in by_suite(runs.iter()) {
                p.suite { (suite) }
                @for judged in runs {
                    @let s = &judged.summary.scores;
                    @let safety = judged.soft().then_some(s.safety_success_rate);
                    div.row {
                        span.name { (judged.method) }
                        svg width="100%" height=(2.0 * PITCH) aria-hidden="true" {
                            @for quarter in 0..=4 { line.grid x1=(x(f64::from(quarter) / 4.0)) x2=(x(f64::from(quarter) / 4.0)) y1="0" y2="100%" {} }
                            (bar("goal", Some(s.goal_success_rate), 1.0))
                            (bar("safety", safety, 1.0 + PITCH))
                        }
                        span.value {
                            (percent(s.goal_success_rate)) br;
                            @match safety { Some(rate) => (percent(rate)), None => "N/A" }
                        }
                    }
                }
            }
            (axis(&["0", "25", "50", "75", "100 %"]))
        }
    }
}

fn percent(rate: Rate) -> String {
    rate.rate.map_or_else(|| "–".to_owned(), |rate| format!("{rate:.1} %"))
}

fn swatch(class: &str) -> Markup {
    html! { svg.swatch width="12" height="12" aria-hidden="true" { rect class=(class) width="12" height="12" rx="2" {} } }
}

fn bar(class: &str, rate: Option<Rate>, top: f64) -> Markup {
    let middle = top + 0.5 * BAR;
    html! {
        @if let Some((value, [low, high])) = rate.and_then(|rate| rate.rate.zip(rate.wilson95)) {
            rect class=(class) x="0" y=(y(top)) width=(x(value / 100.0)) height=(BAR) rx="2" {}
            line.interval x1=(x(low / 100.0)) x2=(x(high / 100.0)) y1=(y(middle)) y2=(y(middle)) {}
            @for end in [low, high] {
                line.interval x1=(x(end / 100.0)) x2=(x(end / 100.0)) y1=(y(middle - 3.0)) y2=(y(middle + 3.0)) {}
            }
        } @else {
            text.tick x="4" y=(y(top + 0.5 * BAR + 4.0)) { @if rate.is_some() { "–" } @else { "N/A" } }
        }
    }
}

/// Labels at equal distances under a column of strips.
fn axis(labels: &[&str]) -> Markup {
    let last = labels.len().saturating_sub(1);
    html! {
        div.row.axis {
            span.name {}
            svg width="100%" height="18" aria-hidden="true" {
                @for (i, label) in labels.iter().enumerate() {
                    @let anchor = if i == 0 { "start" } else if i == last { "end" } else { "middle" };
                    text.tick x=(x(i as f64 / last.max(1) as f64)) y="13" text-anchor=(anchor) { (label) }
                }
            }
            span.value {}
        }
    }
}

/// A strip of dots: its name, and D/τ with whether the goal was reached.
type Dots<'a> = (&'a str, Vec<(f64, bool)>);

fn dots_of<'a>(name: &'a str, judged: &RunSummary, asset: Option<&str>) -> Dots<'a> {
    let own = judged.run.records.iter().filter(|r| asset.is_none_or(|asset| r.identity.asset == asset));
    (name, own.filter_map(|r| Some((d_over_tau(r)?, r.verdict.goal))).collect())
}

/// Peak deformation over its threshold: a strip a run.
pub(super) fn distributions(runs: &[RunSummary]) -> Markup {
    let suites: Vec<(&str, Vec<Dots>)> = by_suite(runs.iter().filter(|judged| judged.soft()))
        .into_iter()
        .map(|(suite, runs)| {
            (suite, runs.into_iter().map(|judged| dots_of(&judged.method, judged, None)).collect())
        })
        .collect();
    strips(&suites)
}

/// The same of one run: a strip an object.
pub(super) fn by_asset(judged: &RunSummary) -> Markup {
    let assets = judged.summary.by_asset.keys();
    strips(&[("", assets.map(|asset| dots_of(asset, judged, Some(asset))).collect())])
}

fn strips(groups: &[(&str, Vec<Dots>)]) -> Markup {
    let all = groups.iter().flat_map(|(_, strips)| strips).flat_map(|(_, dots)| dots);
    let most = all.map(|(d, _)| *d).fold(1.5, f64::max).min(MOST_TAU).ceil();
    let step = if most > 3.0 { 1.0 } else { 0.5 };
    let ticks: Vec<f64> = (0..).map(|i| f64::from(i) * step).take_while(|value| *value <= most).collect();
    let labels: Vec<String> =
        ticks.iter().map(|value| if *value == 1.0 { "τ".to_owned() } else { short(*value) }).collect();
    html! {
        div.chart {
            @for (name, strips) in groups {
                @if !name.is_empty() { p.suite { (name) } }
                @for (name, dots) in strips {
                    @let spread = Distribution::of(dots.iter().map(|(d, _)| *d).collect());
                    div.row {
                        span.name { (name) }
                        svg width="100%" height=(STRIP) aria-hidden="true" {
                            @for value in &ticks { line.grid x1=(x(value / most)) x2=(x(value / most)) y1="0" y2="100%" {} }
                            line.limit x1=(x(1.0 / most)) x2=(x(1.0 / most)) y1="0" y2="100%" {}
                            (spread_mark(&spread, most))
                            @for (k, (d, goal)) in dots.iter().enumerate() {
                                // Spread across the strip so that equal ones stay apart.
                                @let up = (((k * 5) % 9) as f64 - 4.0) * 2.4;
                                circle class=(if *goal { "dot" } else { "dot failed" }) cx=(x(d / most)) cy=(y(0.5 * STRIP + up)) r="3" {}
                            }
                        }
                        span.value {
                            @match spread.median { Some(median) => { "median " (short(median)) }, None => "no D" }
                            br; "n " (spread.n)
                        }
                    }
                }
            }
            (axis(&labels.iter().map(String::as_str).collect::<Vec<_>>()))
        }
    }
}

/// From P5 to P95, and the median.
fn spread_mark(of: &Distribution, most: f64) -> Markup {
    let middle = y(0.5 * STRIP);
    html! {
        @if let Some((low, high)) = of.p5.zip(of.p95) {
            line.spread x1=(x(low / most)) x2=(x(high / most)) y1=(middle) y2=(middle) {}
        }
        @if let Some(median) = of.median {
            line.median x1=(x(median / most)) x2=(x(median / most)) y1="4" y2=(y(STRIP - 4.0)) {}
        }
    }
}

/// Safety over the strictness of the thresholds: a plot a suite, a line a run.
pub(super) fn kappa_curves(runs: &[RunSummary]) -> Markup {
    html! {
        @for (suite, runs) in by_suite(runs.iter().filter(|judged| judged.soft())) {
            p.suite { (suite) }
            svg.plot width="100%" height=(PLOT + 22.0) role="img" aria-label=(format!("Safety Success over kappa, {suite}; the numbers are in the table above")) {
                @for quarter in 0..=4 {
                    @let at = level(25.0 * f64::from(quarter));
                    line.grid x1="0" x2="100%" y1=(y(at)) y2=(y(at)) {}
                    @if quarter > 0 { text.tick x="0" y=(y(at - 3.0)) { (25 * quarter) " %" } }
                }
                line.limit x1="50%" x2="50%" y1=(y(level(100.0))) y2=(y(level(0.0))) {}
                @for (i, judged) in runs.iter().enumerate() { (curve(judged, i)) }
                @for fifth in 0..=5 {
                    @let anchor = match fifth { 0 => "start", 5 => "end", _ => "middle" };
                    text.tick x=(x(f64::from(fifth) / 5.0)) y=(y(PLOT + 16.0)) text-anchor=(anchor) { @if fifth == 0 { "κ = 0" } @else { (short(f64::from(fifth) / 5.0)) } }
                }
            }
            p.legend {
                @for (i, judged) in runs.iter().enumerate() {
                    span.key {
                        svg.swatch width="30" height="12" aria-hidden="true" { line class=(style(i)) x1="1" x2="29" y1="6" y2="6" {} }
                        (judged.method)
                    }
                }
            }
        }
    }
}

/// Height of a rate in the plot of curves.
fn level(percent: f64) -> f64 {
    let top = 18.0;
    top + (PLOT - top) * (1.0 - percent / 100.0)
}

/// Six colours, then the same in dashes.
fn style(index: usize) -> String {
    format!("curve c{} d{}", index % 6, index / 6 % 4)
}

fn curve(judged: &RunSummary, index: usize) -> Markup {
    let points: Vec<(f64, f64)> = judged
        .summary
        .kappa
        .iter()
        .filter_map(|row| Some((row.kappa, row.safety_success_rate.rate?)))
        .collect();
    // Lines of equal height lie beside each other.
    let beside = 1.5 * ((index % 5) as f64 - 2.0);
    html! {
        g class=(style(index)) {
            @for pair in points.windows(2) {
                line x1=(x(pair[0].0)) x2=(x(pair[1].0)) y1=(y(level(pair[0].1) + beside)) y2=(y(level(pair[1].1) + beside)) {}
            }
        }
    }
}
