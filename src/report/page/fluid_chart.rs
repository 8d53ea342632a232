//! Charts as wide as the page allows: places are in percent of the width, so that text does not shrink on narrow
//! screens.

use maud::{Markup, html};

use softvt_media::{
    axis::Axis,
    chart::{Chart, FONT_SIZE, Frame},
    drawing::{Area, Element, Place, Symbol, Tone},
};

/// Room for the title of a chart, the labels of its horizontal axis, and the title of that, pixels.
const TITLE: f32 = 18.0;
const TICKS: f32 = 20.0;
const AXIS_TITLE: f32 = 18.0;
/// Room above the area, pixels.
const TOP: f32 = 6.0;

/// A chart whose area has this height, pixels. Labels of the vertical axis and names of curves are outside of it.
pub(super) fn fluid_chart(chart: &Chart, height: f32) -> Markup {
    let top = if chart.title.is_empty() { TOP } else { TOP + TITLE };
    let below = if chart.x.label.is_empty() { TICKS } else { TICKS + AXIS_TITLE };
    let area = Area { left: 0.0, right: 1.0, top, bottom: top + height };
    let frame = Frame { area, unit: 1.0 };
    let names = chart.names(&frame);
    html! {
        svg.plot width="100%" height=(area.bottom + below) aria-hidden="true" {
            @for element in chart.contents(&frame) { (shown(&element, percent)) }
            // Places of names are in pixels from the right edge.
            @if !names.is_empty() { svg x="100%" aria-hidden="true" { @for name in &names { (shown(name, px)) } } }
        }
    }
}

pub(super) fn percent_axis(intervals: usize) -> Axis {
    let mut axis = Axis::linear("", 0.0, 100.0, intervals).with_grid();
    axis.ticks.iter_mut().for_each(|tick| tick.label += " %");
    axis
}

fn percent(share: f32) -> String {
    format!("{:.2}%", 100.0 * share)
}

fn px(at: f32) -> String {
    format!("{at:.1}")
}

/// Small circles let others show through.
fn symbol_class(Symbol { tone, radius, .. }: &Symbol) -> &'static str {
    match (tone, *radius < Symbol::DOT.radius) {
        (Tone::Harm, true) => "over small",
        (Tone::Harm, false) => "over",
        (_, true) => "safe small",
        (_, false) => "safe",
    }
}

/// An element whose places from the left are written by `x`.
fn shown(element: &Element, x: fn(f32) -> String) -> Markup {
    html! {
        @match element {
            Element::Line(places, stroke) => {
                g class=(stroke.class()) {
                    @for pair in places.windows(2) {
                        line x1=(x(pair[0].x)) y1=(px(pair[0].y)) x2=(x(pair[1].x)) y2=(px(pair[1].y)) {}
                    }
                }
            }
            Element::Area(area, fill) => {
                rect class=(fill.class()) x=(x(area.left)) width=(x(area.width())) y=(px(area.top)) height=(px(area.height())) {}
            }
            Element::Symbol(place, symbol) => {
                circle class=(symbol_class(symbol)) cx=(x(place.x)) cy=(px(place.y)) r=(symbol.radius) {}
            }
            Element::Text { place: Place { x: left, y: top }, shift, anchor, text, .. } => {
                text.tick x=(x(*left)) y=(px(*top)) dx=(shift) text-anchor=(anchor.name()) { (text) }
            }
            Element::Tag { place: Place { x: left, y: top }, shift, text, .. } => {
                text.tick x=(x(*left)) y=(px(top + FONT_SIZE)) dx=(shift) { (text) }
            }
        }
    }
}
