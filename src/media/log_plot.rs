//! Panels of curves with logarithmic axes, as SVG.

use super::{
    plot::PlotPoint,
    svg::{self, Anchor, Place, at, circle, line, polyline, text},
    ticks::Decades,
};

/// Width and height of a panel, px.
const PANEL: [f64; 2] = [320.0, 240.0];
/// Margins of a panel around its plotting area, px.
const LEFT: f64 = 52.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 40.0;
const FONT_SIZE: f64 = 11.0;

/// A curve of positive values in a panel of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct LogPanel {
    /// Text above the panel.
    pub title: String,
    /// Label below the horizontal axis.
    pub x_label: String,
    /// Points of the curve.
    pub points: Vec<PlotPoint>,
}

/// An image of panels, two side by side.
pub fn svg(panels: &[LogPanel]) -> String {
    let [width, height] = [2.0 * PANEL[0], PANEL[1] * panels.len().div_ceil(2) as f64];
    let drawn: String = panels.iter().enumerate().map(|(index, panel)| draw(index, panel)).collect();
    let titles: Vec<&str> = panels.iter().map(|panel| panel.title.as_str()).collect();
    svg::image(width, height, FONT_SIZE, &titles.join("; "), &drawn)
}

fn draw(index: usize, panel: &LogPanel) -> String {
    let (x0, y0) = (PANEL[0] * (index % 2) as f64, PANEL[1] * (index / 2) as f64);
    let (left, right) = (x0 + LEFT, x0 + PANEL[0] - RIGHT);
    let (top, base) = (y0 + TOP, y0 + PANEL[1] - BOTTOM);
    let across = Decades::around(panel.points.iter().map(|point| point.x));
    let up = Decades::around(panel.points.iter().map(|point| point.y));
    let x = |value: f64| left + across.share(value) * (right - left);
    let y = |value: f64| base - up.share(value) * (base - top);
    let columns = across.ticks().map(|tick| {
        line(at(x(tick), top), at(x(tick), base), "grid")
            + &text(at(x(tick), base + 14.0), Anchor::Middle, "", &short(tick))
    });
    let rows = up.ticks().map(|tick| {
        line(at(left, y(tick)), at(right, y(tick)), "grid")
            + &text(at(left - 5.0, y(tick) + 4.0), Anchor::End, "", &short(tick))
    });
    let places: Vec<Place> = panel.points.iter().map(|point| at(x(point.x), y(point.y))).collect();
    let mark = |(point, place): (&PlotPoint, &Place)| {
        circle(*place, 3.0, if point.is_filled { "dot" } else { "ring" })
    };
    let grid: String = columns.chain(rows).collect();
    grid + &polyline(&places, "curve")
        + &panel.points.iter().zip(&places).map(mark).collect::<String>()
        + &text(at(left, y0 + 16.0), Anchor::Start, "title", &panel.title)
        + &text(at(0.5 * (left + right), base + 30.0), Anchor::Middle, "", &panel.x_label)
}

/// A power of ten.
fn short(tick: f64) -> String {
    if tick >= 1e4 { format!("1e{:.0}", tick.log10()) } else { format!("{tick}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_a_straight_line_and_one_point_has_axes() {
        let point = |x: f64, y: f64| PlotPoint { x, y, is_filled: true };
        let points = vec![point(1.0, 1.0), point(10.0, 10.0), point(100.0, 100.0)];
        let panel = LogPanel { title: "cost".to_owned(), x_label: "size".to_owned(), points };
        let text = svg(&[panel]);
        assert!(text.contains("<polyline points=\"52.0,200.0 179.0,113.0 306.0,26.0\""), "{text}");
        let alone = LogPanel { title: String::new(), x_label: String::new(), points: vec![point(1.0, 7.0)] };
        let text = svg(&[alone]);
        assert!(text.contains("<circle") && !text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}
