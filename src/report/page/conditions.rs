//! Effects of conditions: Safety and D/τ over the values of each factor.

use maud::{Markup, html};

use super::fluid_chart::{fluid_chart, percent_axis};
use crate::condition_effects::{ConditionEffects, FactorTrend, TrendPoint};
use softvt_common::text::{shortened, significant};
use softvt_media::{
    axis::{Axis, Scale, Tick},
    chart::{Chart, ChartPoint, Curve, Mark},
    drawing::{Stroke, Symbol, Tone},
};

/// Heights of the charts of Safety and of D/τ, pixels.
const SAFETY_HEIGHT: f32 = 64.0;
const RATIO_HEIGHT: f32 = 94.0;
/// Ratio of the largest to the smallest value from which an axis is logarithmic.
const LOG_RATIO: f64 = 5.0;
/// Largest length of a factor's name at its axis.
const MAX_NAME: usize = 30;
/// Smallest distance of labelled values, as a fraction of the width.
const LABEL_DISTANCE: f64 = 0.13;
/// Place of the reference, and of the smallest and largest value, as fractions of the width.
const REFERENCE: f64 = 0.07;
const VALUES: [f64; 2] = [0.27, 0.93];
const TREND: Stroke = Stroke::Curve { tone: Tone::Ink, dash: 0 };
const EPISODE: Symbol = Symbol::DOT.with_radius(2.4);

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

    /// The axis of a chart, in fractions of its width.
    fn axis(&self, label: String, labelled: Vec<(f64, String)>) -> Axis {
        let tick = |(value, label)| Tick { value, label, tone: Tone::Ink };
        let ticks = labelled.into_iter().map(tick).collect();
        Axis { label, scale: Scale::Linear { from: 0.0, to: 1.0 }, ticks, has_grid: false }
    }
}

fn panel(trend: &FactorTrend, reference: &TrendPoint, largest: f64) -> Markup {
    let axis = ValueAxis::of(&trend.points);
    let points: Vec<&TrendPoint> = std::iter::once(reference).chain(&trend.points).collect();
    html! {
        div.axes role="img" aria-label={ "Safety and D/τ over " (trend.factor) "; the numbers are in the table below" } {
            (fluid_chart(&safety_chart(&points, &axis), SAFETY_HEIGHT))
            (fluid_chart(&ratio_chart(&points, &axis, &trend.factor, largest), RATIO_HEIGHT))
        }
    }
}

fn curve(points: Vec<ChartPoint>, stroke: Option<Stroke>) -> Mark {
    Mark::Curve(Curve { name: String::new(), points, stroke })
}

/// A line between the reference and the values of the factor.
fn separator(y: [f64; 2]) -> Mark {
    let x = 0.5 * (REFERENCE + VALUES[0]);
    curve(y.map(|y| ChartPoint { x, y, symbol: None }).to_vec(), Some(Stroke::Grid))
}

/// Safety with its intervals, and a line through the rates at the values of the factor.
fn safety_chart(points: &[&TrendPoint], axis: &ValueAxis) -> Chart {
    let point = |of: &&TrendPoint| {
        let symbol = Some(Symbol::DOT.with_radius(4.0));
        Some(ChartPoint { x: axis.place(of.value), y: of.safety.rate?, symbol })
    };
    let whisker = |of: &&TrendPoint| {
        let x = axis.place(of.value);
        let ends = of.safety.wilson95?.map(|y| ChartPoint { x, y, symbol: None });
        Some(curve(ends.to_vec(), Some(Stroke::Whisker)))
    };
    let mut marks = vec![separator([0.0, 100.0])];
    marks.extend(points.iter().filter_map(whisker));
    marks.push(curve(points[..1].iter().filter_map(point).collect(), None));
    marks.push(curve(points[1..].iter().filter_map(point).collect(), Some(TREND)));
    Chart { title: "Safety".to_owned(), x: axis.axis(String::new(), Vec::new()), y: percent_axis(2), marks }
}

/// D/τ of each episode, the medians with a line through them, and τ.
fn ratio_chart(points: &[&TrendPoint], axis: &ValueAxis, factor: &str, largest: f64) -> Chart {
    let episodes = points.iter().flat_map(|of| of.d_over_tau.iter().map(|ratio| (of.value, *ratio)));
    let episode = |(value, y): (Option<f64>, f64)| {
        let tone = if y > 1.0 { Tone::Harm } else { Tone::Safe };
        ChartPoint { x: axis.place(value), y, symbol: Some(Symbol { tone, ..EPISODE }) }
    };
    let median =
        |of: &&TrendPoint| Some(ChartPoint { x: axis.place(of.value), y: of.median()?, symbol: None });
    let of_reference = points[0].median().map(|y| {
        let ends = [-0.02, 0.02].map(|reach| ChartPoint { x: REFERENCE + reach, y, symbol: None });
        curve(ends.to_vec(), Some(TREND))
    });
    let mut marks = vec![
        separator([0.0, largest]),
        Mark::Level { y: 1.0, label: "limit τ".to_owned() },
        curve(episodes.map(episode).collect(), None),
        curve(points[1..].iter().filter_map(median).collect(), Some(TREND)),
    ];
    marks.extend(of_reference);
    let log = if axis.is_log { ", log" } else { "" };
    let label = "value of ".to_owned() + &shortened(factor, MAX_NAME) + log;
    let mut labelled = vec![(REFERENCE, "ref.".to_owned())];
    for value in points[1..].iter().filter_map(|point| point.value) {
        let place = axis.place(Some(value));
        if labelled.last().is_none_or(|(last, _)| place - last >= LABEL_DISTANCE) {
            labelled.push((place, significant(value, 3)));
        }
    }
    let y = Axis::linear("", 0.0, largest, 3).with_grid();
    Chart { title: "D/limit".to_owned(), x: axis.axis(label, labelled), y, marks }
}
