//! Charts: values over two axes, as elements of a drawing, which [`svg`] and [`canvas`](super::canvas) show.
//!
//! Written by hand: the crate `plotters` (0.3.7 was tried) rounds places to whole pixels, writes colours as numbers, so
//! that an image has one ground, and draws text on pixels with a typeface that has to be registered in the process.
//! Both of its back ends would have to be replaced, and its ticks, bands and names at curves as well.

use super::{
    axis::Axis,
    drawing::{Anchor, Area, Element, Fill, Font, Place, Stroke, Symbol, Tone, at, line, styled_text, text},
    svg,
};

/// Size of texts at axes in units of a layout, px at a unit of 1.
pub const FONT_SIZE: f32 = 11.0;
/// Least distance of the names of curves, units.
const NAME_HEIGHT: f32 = 13.0;

/// Values over two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    /// Parts in the order in which they are drawn. Values beyond the ends of an axis are drawn at them.
    pub marks: Vec<Mark>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A range of the horizontal axis.
    Band {
        from: f64,
        to: f64,
        /// Text in the band where it does not hold what it seems to; the band is then hatched.
        objection: Option<&'static str>,
    },
    Above(f64),
    /// An interval of values over a range of the horizontal axis.
    Interval {
        /// Ends of the range.
        x: [f64; 2],
        /// Smallest and largest value.
        y: [f64; 2],
    },
    /// A value of the vertical axis, with a text at its left end.
    Level {
        y: f64,
        label: String,
    },
    /// A value of the horizontal axis, with a text above the chart.
    Guide {
        x: f64,
        label: String,
    },
    /// A value of the horizontal axis, with a text in the chart.
    Event {
        x: f64,
        label: String,
    },
    /// Points, and a line through them.
    Curve(Curve),
    /// Bars of equal width from end to end of the horizontal axis.
    Bars(Vec<usize>),
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Name at the last point; empty for none.
    pub name: String,
    /// The points, in the order in which a line joins them.
    pub points: Vec<ChartPoint>,
    /// Style of the line; none for points alone.
    pub stroke: Option<Stroke>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartPoint {
    pub x: f64,
    pub y: f64,
    /// Its symbol; none for a point of a line.
    pub symbol: Option<Symbol>,
}

/// Style of the line of a chart with one curve.
pub const SINGLE_CURVE: Stroke = Stroke::Curve { tone: Tone::Safe, dash: 0 };

/// Place and size of a chart in a drawing.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The area between the axes, px.
    pub area: Area,
    /// Pixels of a unit, in which texts and their distances are measured.
    pub unit: f32,
}

impl Frame {
    /// Pixels of a length in units.
    pub fn px(&self, units: f32) -> f32 {
        units * self.unit
    }
}

impl Chart {
    pub fn elements(&self, frame: &Frame) -> Vec<Element> {
        let names = self.names(frame).into_iter().map(|element| element.shifted(frame.area.right));
        self.contents(frame).into_iter().chain(names).collect()
    }

    /// The elements of [`Self::elements`] without the names of the curves.
    pub fn contents(&self, frame: &Frame) -> Vec<Element> {
        let Area { left, top, .. } = frame.area;
        let has_guides = self.marks.iter().any(|mark| matches!(mark, Mark::Guide { .. }));
        let title_height = frame.px(if has_guides { 42.0 } else { 8.0 });
        let mut drawn =
            vec![styled_text(at(left, top - title_height), Anchor::Start, Font::Title, &self.title)];
        let is_behind =
            |mark: &&Mark| matches!(mark, Mark::Band { .. } | Mark::Above(_) | Mark::Interval { .. });
        for mark in self.marks.iter().filter(is_behind) {
            self.draw_mark(&mut drawn, frame, mark);
        }
        self.draw_axes(&mut drawn, frame);
        for mark in self.marks.iter().filter(|mark| !is_behind(mark)) {
            self.draw_mark(&mut drawn, frame, mark);
        }
        // Labels that are shared or missing.
        drawn.retain(|element| !matches!(element, Element::Text { text, .. } if text.is_empty()));
        drawn
    }

    /// Height of a value, px.
    fn y(&self, frame: &Frame, value: f64) -> f32 {
        frame.area.bottom - self.y.share(value) as f32 * frame.area.height()
    }

    fn x(&self, frame: &Frame, value: f64) -> f32 {
        frame.area.left + frame.area.width() * self.x.share(value) as f32
    }

    fn draw_axes(&self, drawn: &mut Vec<Element>, frame: &Frame) {
        let Area { left, right, top, bottom } = frame.area;
        for tick in self.x.ticks.iter().filter(|_| self.x.has_grid) {
            let x = self.x(frame, tick.value);
            drawn.push(line(at(x, top), at(x, bottom), Stroke::Grid));
        }
        for tick in self.y.ticks.iter().filter(|_| self.y.has_grid) {
            let y = self.y(frame, tick.value);
            drawn.push(line(at(left, y), at(right, y), Stroke::Grid));
        }
        drawn.push(Element::Line(vec![at(left, top), at(left, bottom), at(right, bottom)], Stroke::Axis));
        for tick in &self.x.ticks {
            let x = self.x(frame, tick.value);
            if !self.x.has_grid {
                drawn.push(line(at(x, bottom), at(x, bottom + frame.px(3.0)), Stroke::Axis));
            }
            let place = at(x, bottom + frame.px(14.0));
            drawn.push(styled_text(place, Anchor::Middle, Font::Plain(tick.tone), &tick.label));
        }
        for tick in &self.y.ticks {
            let y = self.y(frame, tick.value);
            if !self.y.has_grid {
                drawn.push(line(at(left - frame.px(3.0), y), at(left, y), Stroke::Axis));
            }
            let place = at(left, y + 0.33 * frame.px(FONT_SIZE));
            let label = styled_text(place, Anchor::End, Font::Plain(tick.tone), &tick.label);
            drawn.push(label.shifted(-frame.px(6.0)));
        }
        drawn.extend(axis_titles(frame, &self.x.label, &self.y.label));
    }

    fn draw_mark(&self, drawn: &mut Vec<Element>, frame: &Frame, mark: &Mark) {
        let Area { left, right, top, bottom } = frame.area;
        match mark {
            Mark::Band { from, to, objection } => {
                let [left, right] = [*from, *to].map(|value| self.x(frame, value));
                let fill = if objection.is_some() { Fill::Hatched } else { Fill::Band };
                drawn.push(Element::Area(Area { left, right, top, bottom }, fill));
                let place = at(0.5 * (left + right), bottom - frame.px(9.0));
                drawn.extend(objection.map(|what| styled_text(place, Anchor::Middle, Font::Strong, what)));
            }
            Mark::Above(value) => {
                drawn.push(Element::Area(Area { bottom: self.y(frame, *value), ..frame.area }, Fill::Harm));
            }
            Mark::Interval { x: [from, to], y: [low, high] } => {
                let [left, right] = [*from, *to].map(|value| self.x(frame, value));
                let [top, bottom] = [*high, *low].map(|value| self.y(frame, value));
                drawn.push(Element::Area(Area { left, right, top, bottom }, Fill::Interval));
            }
            Mark::Level { y, label } => {
                let y = self.y(frame, *y);
                drawn.push(line(at(left, y), at(right, y), Stroke::Limit));
                let place = at(left, y - frame.px(5.0));
                let label = styled_text(place, Anchor::Start, Font::Strong, label);
                drawn.push(label.shifted(frame.px(6.0)));
            }
            Mark::Guide { x, label } => {
                let is_left = self.x.share(*x) < 0.5;
                let (x, y) = (self.x(frame, *x), top - frame.px(if is_left { 17.0 } else { 4.0 }));
                drawn.push(line(at(x, y - frame.px(9.0)), at(x, bottom), Stroke::Guide));
                let (anchor, shift) = if is_left { (Anchor::Start, 4.0) } else { (Anchor::End, -4.0) };
                drawn.push(text(at(x, y), anchor, label).shifted(frame.px(shift)));
            }
            Mark::Event { x, label } => {
                let x = self.x(frame, *x);
                drawn.push(line(at(x, top), at(x, bottom), Stroke::Event));
                let (place, shift) = (at(x, top), frame.px(3.0));
                drawn.push(Element::Tag { place, shift, right, text: label.clone() });
            }
            Mark::Curve(Curve { points, stroke, .. }) => {
                let places: Vec<Place> =
                    points.iter().map(|point| at(self.x(frame, point.x), self.y(frame, point.y))).collect();
                let symbols = points.iter().zip(&places);
                let symbols: Vec<Element> = symbols
                    .filter_map(|(point, place)| Some(Element::Symbol(*place, point.symbol?)))
                    .collect();
                if let Some(stroke) = stroke.filter(|_| places.len() > 1) {
                    drawn.push(Element::Line(places, stroke));
                }
                drawn.extend(symbols);
            }
            Mark::Bars(counts) => {
                let width = frame.area.width() / counts.len().max(1) as f32;
                for (bin, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                    let left = left + width * bin as f32;
                    let (right, top) = (left + (width - 1.0).max(0.5), self.y(frame, *count as f64));
                    drawn.push(Element::Area(Area { left, right, top, bottom }, Fill::Bar));
                }
            }
        }
    }

    /// The names of the curves next to their last points, moved apart where they would overlap; x is from the right
    /// edge of the area.
    pub fn names(&self, frame: &Frame) -> Vec<Element> {
        let named = self.marks.iter().filter_map(|mark| match mark {
            Mark::Curve(curve) if !curve.name.is_empty() => {
                Some((self.y(frame, curve.points.last()?.y), curve))
            }
            _ => None,
        });
        let mut named: Vec<(f32, &Curve)> = named.collect();
        named.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut heights: Vec<f32> = named.iter().map(|(y, _)| *y).collect();
        spread(&mut heights, frame.px(NAME_HEIGHT), [f32::NEG_INFINITY, frame.area.bottom]);
        let mut drawn = Vec::new();
        for (y, (_, curve)) in heights.into_iter().zip(named) {
            let symbol = curve.points.last().and_then(|point| point.symbol);
            let (sample, left) = match (symbol, curve.stroke) {
                (Some(symbol), _) => (Some(Element::Symbol(at(frame.px(11.0), y), symbol)), 20.0),
                (None, Some(stroke)) => (Some(line(at(8.0, y), at(26.0, y), stroke)), 29.0),
                (None, None) => (None, 8.0),
            };
            drawn.extend(sample);
            let place = at(frame.px(left), y + 0.33 * frame.px(FONT_SIZE));
            drawn.push(text(place, Anchor::Start, &curve.name));
        }
        drawn
    }
}

fn axis_titles(frame: &Frame, x: &str, y: &str) -> impl Iterator<Item = Element> {
    let Area { left, right, top, bottom } = frame.area;
    let below = at(left + 0.5 * (right - left), bottom + frame.px(33.0));
    let beside = at(left - frame.px(44.0), 0.5 * (top + bottom));
    let below = (!x.is_empty()).then(|| text(below, Anchor::Middle, x));
    below.into_iter().chain((!y.is_empty()).then(|| styled_text(beside, Anchor::Middle, Font::Upward, y)))
}

/// Moves places apart that are less than `gap` from each other, within `ends`: the least and the largest one. The
/// places are ascending, and stay so.
pub fn spread(places: &mut [f32], gap: f32, ends: [f32; 2]) {
    let [mut least, mut most] = ends;
    for place in places.iter_mut() {
        *place = place.max(least);
        least = *place + gap;
    }
    for place in places.iter_mut().rev() {
        *place = place.min(most);
        most = *place - gap;
    }
}

/// Sizes of an image of charts, px.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Charts in a row, at most.
    pub columns: usize,
    /// Width and height of a chart with its margins.
    pub panel: [f32; 2],
    /// Margins within a panel around the area of its chart.
    pub margins: Margins,
    /// Margins around all panels where they share their axes: only those at the left and at the bottom have labels.
    pub shared: Option<Margins>,
    /// Pixels of a unit, in which texts and their distances are measured.
    pub unit: f32,
}

/// Margins, px.
#[derive(Clone, Copy, Debug)]
pub struct Margins {
    pub left: f32,
    pub top: f32,
    pub right: f32,
    pub bottom: f32,
}

impl Layout {
    pub const SINGLE: Self = Self {
        columns: 1,
        panel: [640.0, 360.0],
        margins: Margins { left: 64.0, top: 40.0, right: 24.0, bottom: 46.0 },
        shared: None,
        unit: 12.0 / FONT_SIZE,
    };

    /// The charts as SVG, row by row. `label` says what the image shows.
    pub fn svg(&self, label: &str, charts: &[Chart]) -> String {
        let columns = charts.len().clamp(1, self.columns);
        let rows = charts.len().div_ceil(columns).max(1);
        let outer = self.shared.unwrap_or(Margins { left: 0.0, top: 0.0, right: 0.0, bottom: 0.0 });
        let [width, height] = [self.panel[0] * columns as f32, self.panel[1] * rows as f32];
        let mut drawn = Vec::new();
        for (index, chart) in charts.iter().enumerate() {
            let (column, row) = (index % columns, index / columns);
            let (x, y) = (outer.left + self.panel[0] * column as f32, outer.top + self.panel[1] * row as f32);
            let area = Area {
                left: x + self.margins.left,
                top: y + self.margins.top,
                right: x + self.panel[0] - self.margins.right,
                bottom: y + self.panel[1] - self.margins.bottom,
            };
            let frame = Frame { area, unit: self.unit };
            if self.shared.is_none() {
                drawn.extend(chart.elements(&frame));
                continue;
            }
            let mut inner = chart.clone();
            for (axis, has_labels) in
                [(&mut inner.x, index + columns >= charts.len()), (&mut inner.y, column == 0)]
            {
                axis.label.clear();
                axis.ticks.iter_mut().filter(|_| !has_labels).for_each(|tick| tick.label.clear());
            }
            drawn.extend(inner.elements(&frame));
        }
        if let (Some(outer), Some(chart)) = (self.shared, charts.first()) {
            let [left, top] = [outer.left + self.margins.left, outer.top + self.margins.top];
            let [right, bottom] =
                [outer.left + width - self.margins.right, outer.top + height - self.margins.bottom];
            let frame = Frame { area: Area { left, top, right, bottom }, unit: self.unit };
            drawn.extend(axis_titles(&frame, &chart.x.label, &chart.y.label));
        }
        let (width, height) = (outer.left + width + outer.right, outer.top + height + outer.bottom);
        svg::image(width, height, self.unit * FONT_SIZE, label, &drawn)
    }
}

/// An image with a text in place of a chart, as SVG.
pub fn text_image(what: &str) -> String {
    let Layout { panel: [width, height], margins, unit, .. } = Layout::SINGLE;
    let drawn = text(at(margins.left, margins.top), Anchor::Start, what);
    svg::image(width, height, unit * FONT_SIZE, what, &[drawn])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, points: &[[f64; 2]], symbol: Symbol) -> Mark {
        let point = |[x, y]: &[f64; 2]| ChartPoint { x: *x, y: *y, symbol: Some(symbol) };
        let points = points.iter().map(point).collect();
        Mark::Curve(Curve { name: name.to_owned(), points, stroke: Some(SINGLE_CURVE) })
    }

    /// A layout of panels whose charts have 100 by 100 px.
    fn layout(columns: usize, shared: Option<Margins>) -> Layout {
        let margins = Margins { left: 50.0, top: 50.0, right: 50.0, bottom: 50.0 };
        Layout { columns, panel: [200.0, 200.0], margins, shared, unit: 1.0 }
    }

    #[test]
    fn the_parts_of_a_chart_are_at_their_places() {
        let chart = Chart {
            title: "a < b".to_owned(),
            x: Axis::linear("width", 10.0, 0.0, 5),
            y: Axis::linear("D, %", 0.0, 2.0, 5).with_grid(),
            marks: vec![
                Mark::Band { from: 10.0, to: 5.0, objection: None },
                Mark::Level { y: 1.0, label: "half".to_owned() },
                curve("", &[[10.0, 0.0], [-7.0, 9.0]], Symbol::RING),
                curve("", &[[5.0, 1.0]], Symbol::DIAMOND),
                Mark::Guide { x: 5.0, label: "end".to_owned() },
            ],
        };
        let svg = layout(1, None).svg("a", std::slice::from_ref(&chart));
        for part in [
            "<rect x=\"50.0\" y=\"50.0\" width=\"50.0\" height=\"100.0\" class=\"band\"/>",
            "<line x1=\"50.0\" y1=\"100.0\" x2=\"150.0\" y2=\"100.0\" class=\"limit\"/>",
            "<line x1=\"50.0\" y1=\"150.0\" x2=\"150.0\" y2=\"50.0\" class=\"curve safe\"/>",
            "<circle cx=\"150.0\" cy=\"50.0\" r=\"3\" class=\"ring\"/>",
            "<polygon points=\"96.0,100.0 100.0,96.0 104.0,100.0 100.0,104.0\" class=\"mark\"/>",
            ">end</text>",
            ">a &lt; b</text>",
            ">D, %</text>",
        ] {
            assert!(svg.contains(part), "{part} in\n{svg}");
        }
        let hatched = Mark::Band { from: 10.0, to: 5.0, objection: Some("pressed only") };
        let svg = layout(1, None).svg("a", &[Chart { marks: vec![hatched], ..chart }]);
        assert!(svg.contains("class=\"hatched\"") && svg.contains(">pressed only<"), "{svg}");
        assert!(text_image("nothing").contains(">nothing</text>\n</svg>\n"));
    }

    #[test]
    fn names_of_curves_do_not_overlap() {
        let named = |name: &str, y: f64| curve(name, &[[0.0, y], [10.0, y + 1.0]], Symbol::DOT);
        let chart = Chart {
            title: String::new(),
            x: Axis::linear("x", 0.0, 10.0, 5),
            y: Axis::linear("y", 0.0, 3.0, 5),
            marks: vec![named("one", 1.0), named("two", 1.001)],
        };
        let svg = layout(1, None).svg("", &[chart]);
        let y_of = |name: &str| -> f32 {
            let line = svg.lines().find(|line| line.ends_with(&format!(">{name}</text>"))).expect("a name");
            let (_, y) = line.split_once(" y=\"").expect("a place");
            y.split('"').next().and_then(|y| y.parse().ok()).expect("a number")
        };
        assert!((y_of("one") - y_of("two")).abs() > NAME_HEIGHT - 0.2);
        let mut places = [3.0, 50.0, 50.0, 58.0];
        spread(&mut places, 10.0, [5.0, 60.0]);
        assert_eq!(places, [5.0, 40.0, 50.0, 60.0]);
    }

    #[test]
    fn panels_that_share_their_axes_have_labels_at_the_left_and_at_the_bottom() {
        let chart = Chart {
            title: "t".to_owned(),
            x: Axis::linear("x, mm", 0.0, 4.0, 4),
            y: Axis::linear("y", 0.0, 30.0, 3),
            marks: vec![Mark::Bars(vec![0, 3])],
        };
        let margins = Margins { left: 50.0, top: 0.0, right: 0.0, bottom: 40.0 };
        let count = |svg: &str, what: &str| svg.matches(what).count();
        let shared = layout(2, Some(margins)).svg("", &vec![chart.clone(); 3]);
        assert_eq!((count(&shared, ">4</text>"), count(&shared, ">30</text>")), (2, 2), "{shared}");
        assert_eq!(count(&shared, ">x, mm</text>") + count(&shared, ">y</text>"), 2, "{shared}");
        let own = layout(2, None).svg("", &vec![chart; 3]);
        assert_eq!((count(&own, ">4</text>"), count(&own, ">x, mm</text>")), (3, 3));
        assert_eq!((count(&own, "class=\"bar\""), count(&own, "viewBox=\"0 0 400 400\"")), (3, 1));
    }
}
