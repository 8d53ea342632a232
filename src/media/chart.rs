//! A chart of several series over two axes, linear or logarithmic, as SVG. Series differ in their strokes and marks,
//! and are named at their last points.

use super::{
    labels::spread,
    palette,
    svg::{self, Anchor, Place, at, circle, diamond, line, polyline, text, upward_text},
    ticks::{Decades, linear_ticks, tick_label, tick_step},
};
use softvt_common::text::shortened;

/// Size of the image, px.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 360.0;
/// Margins around the plotting area, px.
const LEFT: f64 = 64.0;
const RIGHT: f64 = 150.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 46.0;
const FONT_SIZE: f64 = 12.0;
/// Number of intervals of an axis, at most.
const TICKS: usize = 6;
/// Number of labelled powers of ten, at most.
const LOG_TICKS: usize = 8;
/// Least distance of the names of series, px.
const NAME_HEIGHT: f64 = 14.0;
/// Letters of the name of a series, and of a title, that fit.
const NAME_LETTERS: usize = 19;
const TITLE_LETTERS: usize = 80;
/// Largest and smallest extent of an axis whose ticks are written as decimals.
const DECIMALS: std::ops::Range<f64> = 1e-4..1e6;
/// Share of the extent of the points that a linear axis adds at both ends.
const PADDING: f64 = 0.04;

/// Style sheet for the strokes of the second and third series; [`svg::image`] has the other classes.
fn style() -> String {
    let colours = svg::on_both_grounds(|of| {
        format!(".second{{stroke:{}}}.third{{stroke:{}}}", of(&palette::INK), of(&palette::FAINT))
    });
    format!("<style>{colours}.second{{stroke-dasharray:7 3}}.third{{stroke-dasharray:2 3}}</style>\n")
}

/// Contents of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// Title, above the plotting area.
    pub title: String,
    /// Horizontal axis.
    pub x: ChartAxis,
    /// Vertical axis.
    pub y: ChartAxis,
    /// The series, at most [`MAX_SERIES`].
    pub series: Vec<Series>,
    /// Horizontal lines.
    pub levels: Vec<ChartLevel>,
}

/// Number of series that can be told apart.
pub const MAX_SERIES: usize = 6;

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChartAxis {
    /// Title, with the unit.
    pub label: String,
    /// True for a logarithmic axis, whose values are positive.
    pub is_logarithmic: bool,
}

/// Values that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name at the last point; empty for none.
    pub label: String,
    /// Points x, y in the order in which a line joins them.
    pub points: Vec<[f64; 2]>,
    /// False for points alone.
    pub has_line: bool,
}

/// A horizontal line.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartLevel {
    /// Its value.
    pub y: f64,
    /// Text at its right end.
    pub label: String,
}

impl Chart {
    /// The chart as SVG.
    pub fn svg(&self) -> String {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let levels = self.levels.iter().map(|level| level.y);
        let scales = Scales {
            x: Scale::around(&self.x, points().map(|[x, _]| *x)),
            y: Scale::around(&self.y, points().map(|[_, y]| *y).chain(levels)),
        };
        let title = text(at(12.0, 20.0), Anchor::Start, "title", &shortened(&self.title, TITLE_LETTERS));
        let drawn: String =
            self.series.iter().enumerate().map(|(i, series)| draw(i, series, &scales)).collect();
        let parts =
            [style(), self.axes(&scales), self.level_lines(&scales), drawn, self.names(&scales), title];
        svg::image(WIDTH, HEIGHT, FONT_SIZE, &self.title, &parts.concat())
    }

    fn axes(&self, scales: &Scales) -> String {
        let base = HEIGHT - BOTTOM;
        let below = scales.x.ticks().into_iter().map(|(tick, label)| {
            let x = scales.x_px(tick);
            line(at(x, base), at(x, base + 4.0), "axis")
                + &text(at(x, base + 17.0), Anchor::Middle, "", &label)
        });
        let beside = scales.y.ticks().into_iter().map(|(tick, label)| {
            let y = scales.y_px(tick);
            line(at(LEFT, y), at(WIDTH - RIGHT, y), "grid")
                + &text(at(LEFT - 6.0, y + 4.0), Anchor::End, "", &label)
        });
        let middle = LEFT + (WIDTH - LEFT - RIGHT) / 2.0;
        beside.chain(below).collect::<String>()
            + &line(at(LEFT, base), at(WIDTH - RIGHT, base), "axis")
            + &line(at(LEFT, TOP), at(LEFT, base), "axis")
            + &text(at(middle, HEIGHT - 10.0), Anchor::Middle, "", &self.x.label)
            + &upward_text(at(16.0, 0.5 * (TOP + base)), &self.y.label)
    }

    fn level_lines(&self, scales: &Scales) -> String {
        let drawn = self.levels.iter().map(|ChartLevel { y, label }| {
            let y = scales.y_px(*y);
            line(at(LEFT, y), at(WIDTH - RIGHT, y), "limit")
                + &text(at(LEFT + 6.0, y - 5.0), Anchor::Start, "over", label)
        });
        drawn.collect()
    }

    /// The names of the series beside their last points, moved apart where they would overlap.
    fn names(&self, scales: &Scales) -> String {
        let last = |series: &Series| series.points.last().map(|[_, y]| scales.y_px(*y) + 4.0);
        let mut names: Vec<(f64, usize)> = self
            .series
            .iter()
            .enumerate()
            .filter(|(_, series)| !series.label.is_empty())
            .filter_map(|(index, series)| Some((last(series)?, index)))
            .collect();
        names.sort_by(|(a, i), (b, j)| a.total_cmp(b).then(i.cmp(j)));
        let mut heights: Vec<&mut f64> = names.iter_mut().map(|(y, _)| y).collect();
        spread(&mut heights, NAME_HEIGHT, [f64::NEG_INFINITY, HEIGHT - BOTTOM + 4.0]);
        let drawn = names.into_iter().map(|(y, index)| {
            let (mark, name) = (at(WIDTH - RIGHT + 12.0, y - 4.0), at(WIDTH - RIGHT + 22.0, y));
            marked(index, mark)
                + &text(name, Anchor::Start, "", &shortened(&self.series[index].label, NAME_LETTERS))
        });
        drawn.collect()
    }
}

fn draw(index: usize, series: &Series, scales: &Scales) -> String {
    let places: Vec<Place> =
        series.points.iter().map(|[x, y]| at(scales.x_px(*x), scales.y_px(*y))).collect();
    let curve = match series.has_line && places.len() > 1 {
        true => polyline(&places, ["curve", "curve second", "curve third"][index % 3]),
        false => String::new(),
    };
    curve + &places.iter().map(|place| marked(index, *place)).collect::<String>()
}

/// The mark of a series.
fn marked(index: usize, place: Place) -> String {
    match index % MAX_SERIES {
        0 => circle(place, 3.0, "dot"),
        1 => diamond(place, 4.0, "mark"),
        2 => circle(place, 3.0, "ring"),
        3 => diamond(place, 4.0, "mark-ring"),
        4 => circle(place, 2.0, "mark"),
        _ => diamond(place, 3.0, "dot"),
    }
}

/// The scales of both axes.
struct Scales {
    x: Scale,
    y: Scale,
}

impl Scales {
    fn x_px(&self, x: f64) -> f64 {
        LEFT + self.x.share(x) * (WIDTH - LEFT - RIGHT)
    }

    fn y_px(&self, y: f64) -> f64 {
        HEIGHT - BOTTOM - self.y.share(y) * (HEIGHT - TOP - BOTTOM)
    }
}

/// The values along an axis.
enum Scale {
    Linear { low: f64, high: f64 },
    Logarithmic(Decades),
}

impl Scale {
    fn around(axis: &ChartAxis, values: impl Iterator<Item = f64>) -> Self {
        if axis.is_logarithmic {
            return Self::Logarithmic(Decades::around(values));
        }
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = values.fold(ends, |(low, high), x| (low.min(x), high.max(x)));
        if low > high {
            return Self::Linear { low: 0.0, high: 1.0 };
        }
        let padding = if low == high { 0.5 * low.abs().max(1.0) } else { PADDING * (high - low) };
        // An axis of values that are not negative begins at 0 or above.
        let low = if low >= 0.0 { (low - padding).max(0.0) } else { low - padding };
        Self::Linear { low, high: high + padding }
    }

    /// Place of a value between the ends of the axis, 0..=1.
    fn share(&self, value: f64) -> f64 {
        match self {
            Self::Linear { low, high } => (value - low) / (high - low),
            Self::Logarithmic(decades) => decades.share(value),
        }
    }

    /// Labelled values.
    fn ticks(&self) -> Vec<(f64, String)> {
        match self {
            Self::Linear { low, high } => {
                let step = tick_step(high - low, TICKS);
                let is_decimal = DECIMALS.contains(&low.abs().max(high.abs()));
                let label = |tick: f64| match is_decimal {
                    true => tick_label(tick, step),
                    // Rounded, since multiples of the step are not exact.
                    false => format!("{:e}", format!("{tick:.3e}").parse::<f64>().unwrap_or(tick)),
                };
                linear_ticks(*low, *high, TICKS).into_iter().map(|tick| (tick, label(tick))).collect()
            }
            Self::Logarithmic(decades) => {
                let ticks: Vec<f64> = decades.ticks().collect();
                let label = |tick: f64| match DECIMALS.contains(&tick) {
                    true => tick_label(tick, tick.min(1.0)),
                    false => format!("{tick:e}"),
                };
                let every = ticks.len().div_ceil(LOG_TICKS);
                ticks.into_iter().step_by(every).map(|tick| (tick, label(tick))).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(label: &str, is_logarithmic: bool) -> ChartAxis {
        ChartAxis { label: label.to_owned(), is_logarithmic }
    }

    #[test]
    fn points_are_at_their_places_and_names_do_not_overlap() {
        let series = |label: &str, y: f64| Series {
            label: label.to_owned(),
            points: vec![[0.0, y], [10.0, y + 1.0]],
            has_line: true,
        };
        let chart = Chart {
            title: "a < b".to_owned(),
            x: axis("width, mm", false),
            y: axis("D, %", false),
            series: vec![series("one", 1.0), series("two", 1.001)],
            levels: vec![ChartLevel { y: 2.0, label: "τ".to_owned() }],
        };
        let svg = chart.svg();
        for part in
            [">a &lt; b<", ">width, mm<", ">D, %<", ">τ<", "class=\"curve\"", "class=\"curve second\""]
        {
            assert!(svg.contains(part), "{part} in\n{svg}");
        }
        let y_of = |name: &str| -> f64 {
            let line = svg.lines().find(|line| line.ends_with(&format!(">{name}</text>"))).expect("a name");
            line.split("y=\"")
                .nth(1)
                .and_then(|rest| rest.split('"').next())
                .expect("y")
                .parse()
                .expect("a number")
        };
        assert!((y_of("one") - y_of("two")).abs() > NAME_HEIGHT - 0.2);
    }

    #[test]
    fn axes_fit_any_values() {
        let chart = |points: &[[f64; 2]], log: bool| Chart {
            x: axis("x", log),
            y: axis("y", log),
            series: vec![Series { points: points.to_vec(), ..Series::default() }],
            ..Chart::default()
        };
        let wide = chart(&[[1.0, 1e-9], [1e12, 1e9]], true).svg();
        assert!(wide.contains(">1e12<") && !wide.contains(">10<"), "{wide}");
        let large = chart(&[[0.0, 0.0], [1.0, 3e9]], false).svg();
        assert!(large.contains(">3e9<"), "{large}");
        let decades = chart(&[[1.0, 0.01], [1000.0, 10.0]], true).svg();
        for tick in [">1<", ">10<", ">100<", ">1000<", ">0.01<", ">0.1<"] {
            assert!(decades.contains(tick), "{tick} in\n{decades}");
        }
        assert!(
            decades.contains("cx=\"64.0\" cy=\"314.0\"") && decades.contains("cx=\"490.0\" cy=\"40.0\""),
            "{decades}"
        );
        for points in [&[][..], &[[3.0, 3.0]], &[[-1.0, -5.0], [1.0, 5.0]]] {
            assert!(!chart(points, false).svg().contains("NaN"), "{points:?}");
        }
    }
}
