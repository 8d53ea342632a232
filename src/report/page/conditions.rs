//! Effects of conditions: Safety and D/τ over the values of each factor.

use maud::{Markup, html};

use super::marks::{vertical_lines, x, y};
use crate::condition_effects::{ConditionEffects, FactorTrend, TrendPoint};
use softvt_common::text::{shortened, significant};
use softvt_media::ticks::{linear_ticks, tick_label, tick_step};

/// Heights of the plots of Safety and of D/τ, and of what is below and above the marks, pixels.
const SAFETY_HEIGHT: f64 = 80.0;
const RATIO_HEIGHT: f64 = 110.0;
const MARGIN: f64 = 8.0;
const LABELS: f64 = 36.0;
/// Ratio of the largest to the smallest value from which an axis is logarithmic.
const LOG_RATIO: f64 = 5.0;
/// Largest length of a factor's name at its axis.
const MAX_NAME: usize = 30;
/// Smallest distance of labelled values, as a fraction of the width.
const LABEL_DISTANCE: f64 = 0.13;
/// Place of the reference, and of the smallest and largest value, as fractions of the width.
const REFERENCE: f64 = 0.07;
const VALUES: [f64; 2] = [0.27, 0.93];

/// Two plots per factor, side by side.
pub(super) fn trends(suite: &ConditionEffects) -> Markup {
    let trends = suite.trends();
    let all = trends.iter().flat_map(|trend| &trend.points).chain(std::iter::once(&suite.reference));
    let largest = all.flat_map(|point| &point.d_over_tau).copied().fold(1.25, f64::max);
    html! {
        div.panels {
            @for trend in &trends {
                div {
                    p.suite { (shortened(&trend.factor, MAX_NAME)) }
                    (panel(trend, &suite.reference, largest))
                }
            }
        }
    }
}

/// Places of the values of a factor.
struct ValueAxis {
    low: f64,
    high: f64,
    is_log: bool,
}

impl ValueAxis {
    fn of(points: &[TrendPoint]) -> Self {
        let value = |at: usize| points[at].value.unwrap_or(0.0);
        let (low, high) = (value(0), value(points.len() - 1));
        Self { low, high, is_log: low > 0.0 && high / low >= LOG_RATIO }
    }

    fn place(&self, value: Option<f64>) -> f64 {
        let Some(value) = value else { return REFERENCE };
        let scale = |value: f64| if self.is_log { value.ln() } else { value };
        let extent = (scale(self.high) - scale(self.low)).max(f64::MIN_POSITIVE);
        VALUES[0] + (VALUES[1] - VALUES[0]) * (scale(value) - scale(self.low)) / extent
    }
}

fn panel(trend: &FactorTrend, reference: &TrendPoint, largest: f64) -> Markup {
    let axis = ValueAxis::of(&trend.points);
    let points: Vec<&TrendPoint> = std::iter::once(reference).chain(&trend.points).collect();
    let mut labelled: Vec<f64> = Vec::new();
    for point in &trend.points {
        let Some(value) = point.value else { continue };
        let place = |value: f64| axis.place(Some(value));
        if labelled.last().is_none_or(|last| place(value) - place(*last) >= LABEL_DISTANCE) {
            labelled.push(value);
        }
    }
    let label = format!("Safety and D/τ over {}; the numbers are in the table below", trend.factor);
    html! {
        div.axes role="img" aria-label=(label) {
            (safety_axis())
            svg.plot width="100%" height=(SAFETY_HEIGHT) aria-hidden="true" { (safety_marks(&points, &axis)) }
            (ratio_axis(largest))
            svg.plot width="100%" height=(RATIO_HEIGHT + LABELS) aria-hidden="true" {
                (ratio_marks(&points, &axis, largest))
                text.tick x=(x(REFERENCE)) y=(y(RATIO_HEIGHT + 14.0)) text-anchor="middle" { "ref." }
                @for value in labelled {
                    text.tick x=(x(axis.place(Some(value)))) y=(y(RATIO_HEIGHT + 14.0)) text-anchor="middle" { (significant(value, 3)) }
                }
                text.tick x="60%" y=(y(RATIO_HEIGHT + 31.0)) text-anchor="middle" {
                    "value of " (shortened(&trend.factor, MAX_NAME)) @if axis.is_log { ", log" }
                }
            }
        }
    }
}

fn level(share: f64, height: f64) -> f64 {
    MARGIN + (height - 2.0 * MARGIN) * (1.0 - share)
}

fn safety_axis() -> Markup {
    html! {
        svg width="100%" height=(SAFETY_HEIGHT) aria-hidden="true" {
            @for percent in [0.0, 50.0, 100.0] {
                text.tick x="100%" y=(y(level(0.01 * percent, SAFETY_HEIGHT) + 4.0)) text-anchor="end" { (percent) " %" }
            }
        }
    }
}

fn safety_marks(points: &[&TrendPoint], axis: &ValueAxis) -> Markup {
    let place = |share: f64| y(level(0.01 * share, SAFETY_HEIGHT));
    html! {
        @for percent in [0.0, 50.0, 100.0] { line.grid x1="0" x2="100%" y1=(place(percent)) y2=(place(percent)) {} }
        (vertical_lines("grid", std::iter::once(0.5 * (REFERENCE + VALUES[0]))))
        text.tick x="100%" y=(place(0.0)) dy="-4" text-anchor="end" { "Safety" }
        @for pair in points[1..].windows(2) {
            @if let Some((a, b)) = pair[0].safety.rate.zip(pair[1].safety.rate) {
                line.trend x1=(x(axis.place(pair[0].value))) x2=(x(axis.place(pair[1].value))) y1=(place(a)) y2=(place(b)) {}
            }
        }
        @for point in points {
            @let at = x(axis.place(point.value));
            @if let Some([low, high]) = point.safety.wilson95 { line.whisker x1=(at) x2=(at) y1=(place(low)) y2=(place(high)) {} }
            @if let Some(rate) = point.safety.rate { circle.safe cx=(at) cy=(place(rate)) r="4" {} }
        }
    }
}

fn ratio_axis(largest: f64) -> Markup {
    let step = tick_step(largest, 3);
    html! {
        svg width="100%" height=(RATIO_HEIGHT + LABELS) aria-hidden="true" {
            @for tick in linear_ticks(0.0, largest, 3) {
                text.tick x="100%" y=(y(level(tick / largest, RATIO_HEIGHT) + 4.0)) text-anchor="end" { (tick_label(tick, step)) }
            }
        }
    }
}

/// D/τ of each episode, the medians with a line through them, and τ.
fn ratio_marks(points: &[&TrendPoint], axis: &ValueAxis, largest: f64) -> Markup {
    let place = |ratio: f64| y(level(ratio / largest, RATIO_HEIGHT));
    html! {
        @for tick in linear_ticks(0.0, largest, 3) { line.grid x1="0" x2="100%" y1=(place(tick)) y2=(place(tick)) {} }
        (vertical_lines("grid", std::iter::once(0.5 * (REFERENCE + VALUES[0]))))
        line.limit x1="0" x2="100%" y1=(place(1.0)) y2=(place(1.0)) {}
        text.tick x="100%" y=(place(1.0)) dy="-4" text-anchor="end" { "limit τ" }
        text.tick x="0" y=(place(1.0)) dy="-4" { "D/limit" }
        @for point in points {
            @let at = x(axis.place(point.value));
            @for ratio in &point.d_over_tau {
                circle class=(if *ratio > 1.0 { "dot over" } else { "dot safe" }) cx=(at) cy=(place(*ratio)) r="2.4" {}
            }
        }
        @for pair in points[1..].windows(2) {
            @if let Some((a, b)) = pair[0].median().zip(pair[1].median()) {
                line.trend x1=(x(axis.place(pair[0].value))) x2=(x(axis.place(pair[1].value))) y1=(place(a)) y2=(place(b)) {}
            }
        }
        @if let Some(median) = points[0].median() { text.tick x=(x(REFERENCE)) y=(place(median)) text-anchor="middle" dy="4" { "—" } }
    }
}
