//! `softvt.plot`: charts of the results of experiments.

use crate::schema::{functions, record};
use softvt_common::text::shortened;
use softvt_media::{
    axis::Axis,
    chart::{Chart, ChartPoint, Curve, Layout, Margins, Mark},
    drawing::{Shape, Stroke, Symbol, Tone},
};

/// The image, with space for the names of the series.
const LAYOUT: Layout =
    Layout { margins: Margins { right: 150.0, ..Layout::SINGLE.margins }, ..Layout::SINGLE };
/// Letters of the name of a series, and of a title, that fit.
const NAME_LETTERS: usize = 19;
const TITLE_LETTERS: usize = 80;
/// Number of intervals of a linear axis, at most.
const TICKS: usize = 6;
/// Symbols of the series, of which no more can be told apart.
const SYMBOLS: [Symbol; 6] = [
    Symbol::DOT,
    Symbol::DIAMOND,
    Symbol::RING,
    Symbol::OPEN_DIAMOND,
    Symbol { shape: Shape::Circle, radius: 2.0, ..Symbol::DIAMOND },
    Symbol { shape: Shape::Diamond, ..Symbol::DOT },
];
/// Colours of the lines of the series in turn, each with dashes of its own.
const TONES: [Tone; 3] = [Tone::Safe, Tone::Ink, Tone::Faint];

record! {
    /// An axis of a plot.
    AxisSpec: "softvt.PlotAxis" as "plot.axis" {
        /// Title, with the unit.
        label: String;
        /// True for a logarithmic axis, whose values must be positive.
        log: bool => Boolean(false);
    }
    /// Values of a plot that belong together.
    SeriesSpec: "softvt.PlotSeries" as "plot.series" {
        /// Name at the last point.
        label: Option<String>;
        /// Points { x, y }, in the order in which a line joins them.
        points: Vec<[f64; 2]>;
        /// False for points without a line.
        line: bool => Boolean(true);
    }
    /// A horizontal line of a plot.
    LevelSpec: "softvt.PlotLevel" as "plot.levels" {
        /// Value on the vertical axis.
        y: f64;
        /// Text on the line.
        label: Option<String>;
    }
}

functions! {
    FUNCTIONS {
        /// Returns a plot as SVG, for the files of an experiment: `softvt.plot { title = "…", x = { label = "gap" },
        /// y = { label = "D, %" }, series = { { label = "bun", points = { { 40, 0.1 }, { 38, 0.4 } } } } }`.
        fn plot(lua) takes spec "softvt.Plot" {
            /// Title above the plot.
            title: String;
            /// The horizontal axis, linear or logarithmic.
            x: AxisSpec;
            /// The vertical axis, linear or logarithmic.
            y: AxisSpec;
            /// The series, at most six.
            series: Vec<SeriesSpec>;
            /// Horizontal lines, such as limits.
            levels: Vec<LevelSpec> => Empty;
        } -> ["string"] {
            if series.len() > SYMBOLS.len() {
                bail!(lua, "plot.series: expected at most {} series, got {}", SYMBOLS.len(), series.len());
            }
            if series.iter().all(|series| series.points.is_empty()) {
                bail!(lua, "plot.series: expected at least one series with a point");
            }
            let values = |axis: usize| series.iter().flat_map(|series| &series.points).map(move |point| point[axis]);
            let of_levels = levels.iter().map(|level| level.y);
            for (name, axis, lowest) in [
                ("x", &x, values(0).fold(f64::MAX, f64::min)),
                ("y", &y, values(1).chain(of_levels).fold(f64::MAX, f64::min)),
            ] {
                if axis.log && lowest <= 0.0 {
                    bail!(lua, "plot.{name}.log: {lowest} has no logarithm; leave log out, or such values");
                }
            }
            /// Beyond this, differences of values are not finite.
            const LARGEST: f64 = 1e300;
            let all = series.iter().flat_map(|series| series.points.iter().flatten()).chain(levels.iter().map(|level| &level.y));
            if let Some(value) = all.copied().find(|value| value.abs() > LARGEST) {
                bail!(lua, "plot: {value:e} is too large to be drawn; leave it out");
            }
            let axis = |axis: &AxisSpec, values: &mut dyn Iterator<Item = f64>| match axis.log {
                true => Axis::decades(&axis.label, values),
                false => Axis::around(&axis.label, values, TICKS),
            };
            let (x, y) = (
                axis(&x, &mut values(0)),
                axis(&y, &mut values(1).chain(levels.iter().map(|level| level.y))).with_grid(),
            );
            let curve = |(at, series): (usize, &SeriesSpec)| {
                let point = |[x, y]: &[f64; 2]| ChartPoint { x: *x, y: *y, symbol: Some(SYMBOLS[at]) };
                let stroke = Stroke::Curve { tone: TONES[at % TONES.len()], dash: at % TONES.len() };
                Mark::Curve(Curve {
                    name: shortened(series.label.as_deref().unwrap_or_default(), NAME_LETTERS),
                    points: series.points.iter().map(point).collect(),
                    stroke: series.line.then_some(stroke),
                })
            };
            let curves: Vec<Mark> = series.iter().enumerate().map(curve).collect();
            let level = |LevelSpec { y, label }| Mark::Level { y, label: label.unwrap_or_default() };
            let marks = levels.into_iter().map(level).chain(curves).collect();
            LAYOUT.svg(&title, &[Chart { title: shortened(&title, TITLE_LETTERS), x, y, marks }])
        }
    }
}
