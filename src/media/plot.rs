//! A plot of values over a horizontal axis, as SVG.

use std::fmt::Write;

/// Size of the image, px.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 300.0;
/// Margins around the plotting area, px.
const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 46.0;
/// Intervals between the labels of the horizontal axis.
const TICKS: u32 = 5;

pub(super) const CURVE: &str = "#2050a0";
const DIAMOND: &str = "#c07020";

/// Contents of a plot. The vertical axis begins at 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// Title, above the plotting area.
    pub title: String,
    /// Ends of the horizontal axis.
    pub x: HorizontalAxis,
    /// Value at the upper end of the vertical axis, positive.
    pub top: f64,
    /// Label of the lower end of the vertical axis.
    pub zero: String,
    /// Range of the horizontal axis with a green background.
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
}

/// A value on the vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelLine {
    /// The value.
    pub y: f64,
    /// Text beside the axis.
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
    /// Side of the line on which the text is.
    pub side: LabelSide,
}

/// Side of a vertical line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabelSide {
    /// The text ends at the line.
    Left,
    /// The text begins at the line.
    Right,
}

/// An image with a text in place of a plot, as SVG.
pub fn text_image(what: &str) -> String {
    image(&text(LEFT, TOP, "start", what))
}

impl Plot {
    /// The plot as SVG.
    pub fn svg(&self) -> String {
        let parts = [
            self.background(),
            self.axes(),
            self.level_lines(),
            self.curve(),
            self.diamonds(),
            self.mark_lines(),
        ];
        image(&(parts.concat() + &text(LEFT, 20.0, "start", &self.title)))
    }

    fn x_px(&self, x: f64) -> f64 {
        let share = (self.x.left - x) / (self.x.left - self.x.right);
        LEFT + share.clamp(0.0, 1.0) * (WIDTH - LEFT - RIGHT)
    }

    fn y_px(&self, y: f64) -> f64 {
        let share = (y / self.top).clamp(0.0, 1.0);
        HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)
    }

    fn background(&self) -> String {
        let Some(AxisBand { left, right }) = self.band else { return String::new() };
        let (from, to) = (self.x_px(left), self.x_px(right));
        format!(
            "<rect x=\"{from:.1}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#d9efd9\"/>\n",
            to - from,
            HEIGHT - TOP - BOTTOM
        )
    }

    fn axes(&self) -> String {
        let base = HEIGHT - BOTTOM;
        let black = "stroke=\"black\"";
        let HorizontalAxis { label, left, right } = &self.x;
        let tick = |k: u32| {
            let value = left - (left - right) * f64::from(k) / f64::from(TICKS);
            let x = self.x_px(value);
            line(x, base, x, base + 4.0, black) + &text(x, base + 17.0, "middle", &format!("{value:.1}"))
        };
        let ticks: String = (0..=TICKS).map(tick).collect();
        let middle = LEFT + (WIDTH - LEFT - RIGHT) / 2.0;
        line(LEFT, base, WIDTH - RIGHT, base, black)
            + &line(LEFT, TOP, LEFT, base, black)
            + &ticks
            + &text(middle, HEIGHT - 10.0, "middle", label)
            + &text(LEFT - 6.0, base, "end", &self.zero)
    }

    fn level_lines(&self) -> String {
        let dashed = "stroke=\"#b03030\" stroke-dasharray=\"5 4\"";
        let drawn = self.levels.iter().map(|LevelLine { y, label }| {
            let y = self.y_px(*y);
            line(LEFT, y, WIDTH - RIGHT, y, dashed) + &text(LEFT - 6.0, y + 4.0, "end", label)
        });
        drawn.collect()
    }

    fn curve(&self) -> String {
        if self.curve.is_empty() {
            return String::new();
        }
        let path: Vec<String> = self
            .curve
            .iter()
            .map(|point| format!("{:.1},{:.1}", self.x_px(point.x), self.y_px(point.y)))
            .collect();
        let mut drawn =
            format!("<polyline points=\"{}\" fill=\"none\" stroke=\"{CURVE}\"/>\n", path.join(" "));
        for point in &self.curve {
            let fill = if point.is_filled { CURVE } else { "white" };
            let (x, y) = (self.x_px(point.x), self.y_px(point.y));
            let _ = writeln!(
                drawn,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{fill}\" stroke=\"{CURVE}\"/>"
            );
        }
        drawn
    }

    fn diamonds(&self) -> String {
        let drawn = self.diamonds.iter().map(|point| {
            let fill = if point.is_filled { DIAMOND } else { "white" };
            let (x, y) = (self.x_px(point.x), self.y_px(point.y));
            let (left, right, top, bottom) = (x - 4.0, x + 4.0, y - 4.0, y + 4.0);
            format!(
                "<polygon points=\"{left:.1},{y:.1} {x:.1},{top:.1} {right:.1},{y:.1} {x:.1},{bottom:.1}\" \
                 fill=\"{fill}\" stroke=\"{DIAMOND}\"/>\n"
            )
        });
        drawn.collect()
    }

    fn mark_lines(&self) -> String {
        let drawn = self.marks.iter().map(|VerticalMark { x, label, side }| {
            let x = self.x_px(*x);
            let anchor = match side {
                LabelSide::Left => "end",
                LabelSide::Right => "start",
            };
            line(x, TOP, x, HEIGHT - BOTTOM, "stroke=\"#308030\"") + &text(x, TOP - 2.0, anchor, label)
        });
        drawn.collect()
    }
}

fn image(contents: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n{contents}</svg>\n"
    )
}

pub(super) fn text(x: f64, y: f64, anchor: &str, what: &str) -> String {
    let escaped = what.replace('&', "&amp;").replace('<', "&lt;");
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{escaped}</text>\n")
}

pub(super) fn line(x1: f64, y1: f64, x2: f64, y2: f64, style: &str) -> String {
    format!("<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_has_its_parts_at_their_places() {
        let plot = Plot {
            title: "a < b".to_owned(),
            x: HorizontalAxis { label: "width".to_owned(), left: 10.0, right: 0.0 },
            top: 2.0,
            zero: "0".to_owned(),
            band: Some(AxisBand { left: 10.0, right: 5.0 }),
            levels: vec![LevelLine { y: 1.0, label: "half".to_owned() }],
            curve: vec![
                PlotPoint { x: 10.0, y: 0.0, is_filled: true },
                PlotPoint { x: -7.0, y: 9.0, is_filled: false },
            ],
            diamonds: vec![PlotPoint { x: 5.0, y: 1.0, is_filled: true }],
            marks: vec![VerticalMark { x: 5.0, label: "end".to_owned(), side: LabelSide::Left }],
        };
        let svg = plot.svg();
        for part in [
            "<rect x=\"64.0\" y=\"34\" width=\"280.0\" height=\"220.0\" fill=\"#d9efd9\"/>",
            "<line x1=\"64.0\" y1=\"144.0\" x2=\"624.0\" y2=\"144.0\" stroke=\"#b03030\" stroke-dasharray=\"5 4\"/>",
            "<polyline points=\"64.0,254.0 624.0,34.0\"",
            "<circle cx=\"624.0\" cy=\"34.0\" r=\"3\" fill=\"white\"",
            "<polygon points=\"340.0,144.0 344.0,140.0 348.0,144.0 344.0,148.0\"",
            "<text x=\"344.0\" y=\"32.0\" text-anchor=\"end\">end</text>",
            ">a &lt; b</text>",
        ] {
            assert!(svg.contains(part), "{part} in\n{svg}");
        }
        assert!(text_image("nothing").contains(">nothing</text>\n</svg>\n"));
    }
}
