//! A plot of values over a horizontal axis, as SVG.

use super::{
    svg::{self, Anchor, Area, Place, at, circle, diamond, line, polyline, rect, text, upward_text},
    ticks::{linear_ticks, tick_label, tick_step},
};

/// Size of the image, px.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 320.0;
/// Margins around the plotting area, px.
const LEFT: f64 = 64.0;
const RIGHT: f64 = 84.0;
const TOP: f64 = 62.0;
const BOTTOM: f64 = 46.0;
const FONT_SIZE: f64 = 12.0;
/// Numbers of intervals of the axes, at most.
const X_TICKS: usize = 6;
const Y_TICKS: usize = 5;
/// Width of a letter, px, from which it follows whether a label fits.
const LETTER: f64 = 6.6;

/// Contents of a plot. The vertical axis begins at 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// Title, above the plotting area.
    pub title: String,
    /// Ends of the horizontal axis.
    pub x: HorizontalAxis,
    /// Title of the vertical axis, with its unit.
    pub y_label: String,
    /// Value at the upper end of the vertical axis, positive.
    pub top: f64,
    /// Range of the horizontal axis with a coloured background.
    pub band: Option<AxisBand>,
    /// Dashed horizontal lines.
    pub levels: Vec<LevelLine>,
    /// Dots on a line, rings where they are not filled.
    pub curve: Vec<PlotPoint>,
    /// Diamonds without a line.
    pub diamonds: Vec<PlotPoint>,
    /// Vertical lines.
    pub marks: Vec<VerticalMark>,
}

/// A horizontal axis, in either direction. Values beyond its ends are drawn at them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HorizontalAxis {
    /// Label below the axis.
    pub label: String,
    /// Value at the left end.
    pub left: f64,
    /// Value at the right end, another one than at the left.
    pub right: f64,
}

/// A range of the horizontal axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisBand {
    /// Left end.
    pub left: f64,
    /// Right end.
    pub right: f64,
    /// Text in the band where it does not hold what it seems to; the band is then hatched.
    pub objection: Option<&'static str>,
}

/// A value on the vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelLine {
    /// The value.
    pub y: f64,
    /// Text at the right end of the line.
    pub label: String,
}

/// A point of the plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlotPoint {
    /// Place on the horizontal axis.
    pub x: f64,
    /// Place on the vertical axis.
    pub y: f64,
    /// False to draw the outline only.
    pub is_filled: bool,
}

/// A value on the horizontal axis.
#[derive(Clone, Debug, PartialEq)]
pub struct VerticalMark {
    /// The value.
    pub x: f64,
    /// Text above the line.
    pub label: String,
}

/// An image with a text in place of a plot, as SVG.
pub fn text_image(what: &str) -> String {
    image(what, &text(at(LEFT, TOP), Anchor::Start, "", what))
}

impl Plot {
    /// The plot as SVG.
    pub fn svg(&self) -> String {
        let title = text(at(12.0, 20.0), Anchor::Start, "title", &self.title);
        let parts = [
            self.grid(),
            self.background(),
            self.axes(),
            self.level_lines(),
            self.curve(),
            self.diamonds(),
            self.mark_lines(),
            title,
        ];
        image(&self.title, &parts.concat())
    }

    fn x_px(&self, x: f64) -> f64 {
        let share = (self.x.left - x) / (self.x.left - self.x.right);
        LEFT + share.clamp(0.0, 1.0) * (WIDTH - LEFT - RIGHT)
    }

    fn y_px(&self, y: f64) -> f64 {
        let share = (y / self.top).clamp(0.0, 1.0);
        HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)
    }

    fn place(&self, point: &PlotPoint) -> Place {
        at(self.x_px(point.x), self.y_px(point.y))
    }

    fn background(&self) -> String {
        let Some(AxisBand { left, right, objection }) = self.band else { return String::new() };
        let (from, to) = (self.x_px(left), self.x_px(right));
        let area = Area { x: from, y: TOP, width: to - from, height: HEIGHT - TOP - BOTTOM };
        let class = if objection.is_some() { "pressed" } else { "band" };
        let said = objection
            .map(|what| text(at(0.5 * (from + to), HEIGHT - BOTTOM - 10.0), Anchor::Middle, "over", what));
        rect(area, class) + &said.unwrap_or_default()
    }

    fn grid(&self) -> String {
        let drawn = linear_ticks(0.0, self.top, Y_TICKS).into_iter().map(|tick| {
            let y = self.y_px(tick);
            line(at(LEFT, y), at(WIDTH - RIGHT, y), "grid")
        });
        drawn.collect()
    }

    fn axes(&self) -> String {
        let base = HEIGHT - BOTTOM;
        let HorizontalAxis { label, left, right } = &self.x;
        let step = tick_step((left - right).abs(), X_TICKS);
        let below = linear_ticks(*left, *right, X_TICKS).into_iter().map(|tick| {
            let x = self.x_px(tick);
            let label = text(at(x, base + 17.0), Anchor::Middle, "", &tick_label(tick, step));
            line(at(x, base), at(x, base + 4.0), "axis") + &label
        });
        let step = tick_step(self.top, Y_TICKS);
        let beside = linear_ticks(0.0, self.top, Y_TICKS).into_iter().map(|tick| {
            text(at(LEFT - 6.0, self.y_px(tick) + 4.0), Anchor::End, "", &tick_label(tick, step))
        });
        let middle = LEFT + (WIDTH - LEFT - RIGHT) / 2.0;
        let ticks: String = below.chain(beside).collect();
        line(at(LEFT, base), at(WIDTH - RIGHT, base), "axis")
            + &line(at(LEFT, TOP), at(LEFT, base), "axis")
            + &ticks
            + &text(at(middle, HEIGHT - 10.0), Anchor::Middle, "", label)
            + &upward_text(at(16.0, 0.5 * (TOP + base)), &self.y_label)
    }

    fn level_lines(&self) -> String {
        let drawn = self.levels.iter().map(|LevelLine { y, label }| {
            let y = self.y_px(*y);
            line(at(LEFT, y), at(WIDTH - RIGHT, y), "limit")
                + &text(at(WIDTH - RIGHT + 6.0, y + 4.0), Anchor::Start, "", label)
        });
        drawn.collect()
    }

    fn curve(&self) -> String {
        if self.curve.is_empty() {
            return String::new();
        }
        let places: Vec<Place> = self.curve.iter().map(|point| self.place(point)).collect();
        let dots = self
            .curve
            .iter()
            .zip(&places)
            .map(|(point, place)| circle(*place, 3.0, if point.is_filled { "dot" } else { "ring" }));
        polyline(&places, "curve") + &dots.collect::<String>()
    }

    fn diamonds(&self) -> String {
        let drawn = self
            .diamonds
            .iter()
            .map(|point| diamond(self.place(point), 4.0, if point.is_filled { "mark" } else { "mark-ring" }));
        drawn.collect()
    }

    /// Lines with their labels, each in a row of its own, on the side on which it fits.
    fn mark_lines(&self) -> String {
        let drawn = self.marks.iter().enumerate().map(|(row, VerticalMark { x, label })| {
            let x = self.x_px(*x);
            let y = TOP - 18.0 + 14.0 * (row % 2) as f64;
            let fits = x + LETTER * label.chars().count() as f64 <= WIDTH;
            let (anchor, gap) = if fits { (Anchor::Start, 4.0) } else { (Anchor::End, -4.0) };
            line(at(x, y - 10.0), at(x, HEIGHT - BOTTOM), "end") + &text(at(x + gap, y), anchor, "", label)
        });
        drawn.collect()
    }
}

fn image(label: &str, contents: &str) -> String {
    svg::image(WIDTH, HEIGHT, FONT_SIZE, label, contents)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_has_its_parts_at_their_places() {
        let plot = Plot {
            title: "a < b".to_owned(),
            x: HorizontalAxis { label: "width".to_owned(), left: 10.0, right: 0.0 },
            y_label: "D, %".to_owned(),
            top: 2.0,
            band: Some(AxisBand { left: 10.0, right: 5.0, objection: None }),
            levels: vec![LevelLine { y: 1.0, label: "half".to_owned() }],
            curve: vec![
                PlotPoint { x: 10.0, y: 0.0, is_filled: true },
                PlotPoint { x: -7.0, y: 9.0, is_filled: false },
            ],
            diamonds: vec![PlotPoint { x: 5.0, y: 1.0, is_filled: true }],
            marks: vec![VerticalMark { x: 5.0, label: "end".to_owned() }],
        };
        let svg = plot.svg();
        for part in [
            "<rect x=\"64.0\" y=\"62.0\" width=\"246.0\" height=\"212.0\" class=\"band\"/>",
            "<line x1=\"64.0\" y1=\"168.0\" x2=\"556.0\" y2=\"168.0\" class=\"limit\"/>",
            "<polyline points=\"64.0,274.0 556.0,62.0\"",
            "<circle cx=\"556.0\" cy=\"62.0\" r=\"3\" class=\"ring\"",
            "<polygon points=\"306.0,168.0 310.0,164.0 314.0,168.0 310.0,172.0\"",
            "<text x=\"314.0\" y=\"44.0\" text-anchor=\"start\">end</text>",
            ">a &lt; b</text>",
            ">D, %</text>",
        ] {
            assert!(svg.contains(part), "{part} in\n{svg}");
        }
        let objection = Some("pressed only");
        let hatched = Plot { band: Some(AxisBand { left: 10.0, right: 5.0, objection }), ..plot }.svg();
        assert!(hatched.contains("class=\"pressed\"") && hatched.contains(">pressed only<"), "{hatched}");
        assert!(text_image("nothing").contains(">nothing</text>\n</svg>\n"));
    }
}
