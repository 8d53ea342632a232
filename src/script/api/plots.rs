//! `softvt.plot`: charts of the results of experiments.

use crate::{
    schema::{functions, record},
    vm::error::fail,
};
use softvt_media::chart::{Chart, ChartAxis, ChartLevel, MAX_SERIES, Series};

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
        /// Name beside the last point.
        label: Option<String>;
        /// Points { x, y }, in the order in which a line joins them.
        points: Vec<[f64; 2]>;
        /// False for points without a line.
        line: bool => Boolean(true);
    }
    /// A horizontal line of a plot.
    LevelSpec: "softvt.PlotLevel" as "plot.levels" {
        /// Its value.
        y: f64;
        /// Text on it.
        label: Option<String>;
    }
}

functions! {
    FUNCTIONS {
        /// Returns a plot as SVG, for the files of an experiment: `softvt.plot { title = "…", x = { label = "gap" },
        /// y = { label = "D, %" }, series = { { label = "bun", points = { { 40, 0.1 }, { 38, 0.4 } } } } }`.
        fn plot(lua) takes spec "softvt.Plot" {
            /// Title.
            title: String;
            /// Horizontal axis.
            x: AxisSpec;
            /// Vertical axis.
            y: AxisSpec;
            /// The series, at most six.
            series: Vec<SeriesSpec>;
            /// Horizontal lines, such as limits.
            levels: Vec<LevelSpec> => Empty;
        } -> ["string"] {
            if series.len() > MAX_SERIES {
                let message = format!(
                    "plot.series: {} series cannot be told apart; give at most {MAX_SERIES}, and further ones in another plot",
                    series.len()
                );
                return Err(fail(lua, message));
            }
            if series.iter().all(|series| series.points.is_empty()) {
                return Err(fail(lua, "plot.series: expected at least one series with a point".to_owned()));
            }
            let values = |axis: usize| series.iter().flat_map(|series| &series.points).map(move |point| point[axis]);
            let of_levels = levels.iter().map(|level| level.y);
            for (name, axis, lowest) in [
                ("x", &x, values(0).fold(f64::MAX, f64::min)),
                ("y", &y, values(1).chain(of_levels).fold(f64::MAX, f64::min)),
            ] {
                if axis.log && lowest <= 0.0 {
                    let message = format!("plot.{name}.log: {lowest} has no logarithm; leave log out, or such values");
                    return Err(fail(lua, message));
                }
            }
            /// Beyond this, differences of values are not finite.
            const LARGEST: f64 = 1e300;
            let all = series.iter().flat_map(|series| series.points.iter().flatten()).chain(levels.iter().map(|level| &level.y));
            if let Some(value) = all.copied().find(|value| value.abs() > LARGEST) {
                return Err(fail(lua, format!("plot: {value:e} is too large to be drawn; leave it out")));
            }
            let axis = |AxisSpec { label, log }| ChartAxis { label, is_logarithmic: log };
            let one = |SeriesSpec { label, points, line }| Series {
                label: label.unwrap_or_default(),
                points,
                has_line: line,
            };
            let level = |LevelSpec { y, label }| ChartLevel { y, label: label.unwrap_or_default() };
            Chart {
                title,
                x: axis(x),
                y: axis(y),
                series: series.into_iter().map(one).collect(),
                levels: levels.into_iter().map(level).collect(),
            }
            .svg()
        }
    }
}
