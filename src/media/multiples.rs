//! Small multiples: plots of one kind with the same axes, side by side, as SVG.

use super::{
    plot::{AxisBand, PlotPoint},
    svg::{self, Anchor, Area, Place, at, circle, line, polyline, rect, text, upward_text},
    ticks::{linear_ticks, tick_label, tick_step},
};

/// Width and height of a panel with its gap to the next, px.
const PANEL: [f64; 2] = [156.0, 132.0];
/// Margins of the image around the panels, px.
const LEFT: f64 = 56.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 46.0;
/// Height of the title of a panel, and the gaps to the panels beside and below, px.
const TITLE: f64 = 22.0;
const GAP: f64 = 14.0;
const FONT_SIZE: f64 = 11.5;
/// Numbers of intervals of the axes, at most.
const X_TICKS: usize = 4;
const Y_TICKS: usize = 3;

/// Plots with the same axes, both of which begin at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallMultiples {
    /// Title of the image, for screen readers.
    pub title: String,
    /// Title of the horizontal axis, with its unit.
    pub x_label: String,
    /// Title of the vertical axis, with its unit.
    pub y_label: String,
    /// Value at the right end of the horizontal axis, positive. Curves end there.
    pub right: f64,
    /// Value at the upper end of the vertical axis, positive. Curves end there.
    pub top: f64,
    /// A dashed horizontal line in every panel.
    pub level: f64,
    /// Number of panels in a row, positive.
    pub columns: usize,
    /// The panels, row by row.
    pub panels: Vec<MultiplePanel>,
}

/// One of several plots.
#[derive(Clone, Debug, PartialEq)]
pub struct MultiplePanel {
    /// Text above the panel.
    pub title: String,
    /// Range of the horizontal axis with a coloured background.
    pub band: Option<AxisBand>,
    /// Dots on a line, rings where they are not filled, from left to right.
    pub curve: Vec<PlotPoint>,
}

impl SmallMultiples {
    /// The plots as SVG.
    pub fn svg(&self) -> String {
        let rows = self.panels.len().div_ceil(self.columns);
        let width = LEFT + PANEL[0] * self.columns as f64 + RIGHT;
        let height = TOP + PANEL[1] * rows as f64 + BOTTOM;
        let panels: String =
            self.panels.iter().enumerate().map(|(index, panel)| self.draw(index, panel)).collect();
        let middle = TOP + 0.5 * PANEL[1] * rows as f64;
        let labels = upward_text(at(14.0, middle), &self.y_label)
            + &text(at(0.5 * (LEFT + width), height - 8.0), Anchor::Middle, "", &self.x_label);
        svg::image(width, height, FONT_SIZE, &self.title, &(panels + &labels))
    }

    fn draw(&self, index: usize, panel: &MultiplePanel) -> String {
        let (column, row) = (index % self.columns, index / self.columns);
        let area = Area {
            x: LEFT + PANEL[0] * column as f64,
            y: TOP + PANEL[1] * row as f64 + TITLE,
            width: PANEL[0] - GAP,
            height: PANEL[1] - TITLE - GAP,
        };
        let is_lowest = index + self.columns >= self.panels.len();
        let title = text(at(area.x, area.y - 6.0), Anchor::Start, "title", &panel.title);
        [
            self.band(area, panel.band),
            self.grid(area, column == 0, is_lowest),
            self.curve(area, &panel.curve),
            title,
        ]
        .concat()
    }

    fn place(&self, area: Area, x: f64, y: f64) -> Place {
        let across = (x / self.right).clamp(0.0, 1.0);
        let up = (y / self.top).clamp(0.0, 1.0);
        at(area.x + across * area.width, area.y + (1.0 - up) * area.height)
    }

    fn band(&self, area: Area, band: Option<AxisBand>) -> String {
        let Some(AxisBand { left, right, objection }) = band else { return String::new() };
        let (from, to) = (self.place(area, left, self.top), self.place(area, right, 0.0));
        let shown = Area { x: from.x, y: from.y, width: (to.x - from.x).max(0.0), height: to.y - from.y };
        let said = objection
            .map(|what| text(at(area.x + area.width - 4.0, area.y + 14.0), Anchor::End, "over", what))
            .unwrap_or_default();
        rect(shown, if objection.is_some() { "pressed" } else { "band" }) + &said
    }

    /// Axes and the level; numbers only at the left and at the bottom.
    fn grid(&self, area: Area, has_y: bool, has_x: bool) -> String {
        let (left, base) = (area.x, area.y + area.height);
        let (x_step, y_step) = (tick_step(self.right, X_TICKS), tick_step(self.top, Y_TICKS));
        let mut drawn = line(at(left, base), at(left + area.width, base), "axis");
        for tick in linear_ticks(0.0, self.right, X_TICKS) {
            let Place { x, .. } = self.place(area, tick, 0.0);
            drawn += &line(at(x, area.y), at(x, base), "grid");
            if has_x {
                drawn += &text(at(x, base + 15.0), Anchor::Middle, "", &tick_label(tick, x_step));
            }
        }
        for tick in linear_ticks(0.0, self.top, Y_TICKS).into_iter().filter(|_| has_y) {
            let Place { y, .. } = self.place(area, 0.0, tick);
            drawn += &text(at(left - 6.0, y + 4.0), Anchor::End, "", &tick_label(tick, y_step));
        }
        let Place { y, .. } = self.place(area, 0.0, self.level);
        drawn + &line(at(left, y), at(left + area.width, y), "limit")
    }

    /// The curve up to the ends of the axes.
    fn curve(&self, area: Area, points: &[PlotPoint]) -> String {
        let inside = |point: &PlotPoint| point.x <= self.right && point.y <= self.top;
        let count = points.iter().take_while(|point| inside(point)).count();
        let mut places: Vec<Place> =
            points[..count].iter().map(|point| self.place(area, point.x, point.y)).collect();
        if let (Some(last), Some(next)) = (count.checked_sub(1).map(|at| points[at]), points.get(count)) {
            let share =
                |from: f64, to: f64, end: f64| if to > end { (end - from) / (to - from) } else { 1.0 };
            let cut = share(last.x, next.x, self.right).min(share(last.y, next.y, self.top));
            let between = |from: f64, to: f64| from + cut * (to - from);
            places.push(self.place(area, between(last.x, next.x), between(last.y, next.y)));
        }
        let dots = points[..count].iter().map(|point| {
            circle(self.place(area, point.x, point.y), 2.0, if point.is_filled { "dot" } else { "ring" })
        });
        polyline(&places, "curve") + &dots.collect::<String>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_share_their_axes_and_curves_end_at_the_top() {
        let point = |x: f64, y: f64| PlotPoint { x, y, is_filled: true };
        let panel = |title: &str, band| MultiplePanel {
            title: title.to_owned(),
            band,
            curve: vec![point(0.0, 0.0), point(1.0, 1.0), point(2.0, 5.0)],
        };
        let band = |objection| Some(AxisBand { left: 0.5, right: 1.0, objection });
        let plots = SmallMultiples {
            title: "all".to_owned(),
            x_label: "x, mm".to_owned(),
            y_label: "y".to_owned(),
            right: 4.0,
            top: 3.0,
            level: 1.0,
            columns: 2,
            panels: vec![
                panel("a < b", band(None)),
                panel("c", band(Some("pressed only"))),
                panel("d", None),
            ],
        };
        let svg = plots.svg();
        for part in [
            "viewBox=\"0 0 380 318\"",
            ">a &lt; b</text>",
            "<rect x=\"73.8\" y=\"30.0\" width=\"17.8\" height=\"96.0\" class=\"band\"/>",
            "class=\"pressed\"",
            "<polyline points=\"56.0,126.0 91.5,94.0 109.2,30.0\" class=\"curve\"/>",
        ] {
            assert!(svg.contains(part), "{part} in\n{svg}");
        }
        assert_eq!((svg.matches("<circle").count(), svg.matches("class=\"limit\"").count()), (6, 3));
        let ticks = |label: &str| svg.matches(&format!(">{label}</text>")).count();
        assert_eq!(
            (ticks("4"), ticks("3")),
            (2, 2 + 2),
            "the lowest of each column, and the left of each row"
        );
    }
}
