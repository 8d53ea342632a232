//! Goal and Safety of the controllers in the hidden suites: two marks with the gap between them.

#[path = "../results/rows.rs"]
mod rows;

use std::path::Path;

use rows::Row;
use softvt::media::{
    drawing::{Anchor, Area, Element, Fill, Font, Place, Stroke, Symbol, Tone, at, line, styled_text, text},
    svg,
};

/// The image, from the root of the repository.
pub const IMAGE: &str = "docs/images/hidden.svg";
/// Script of the runs.
const SCRIPT: &str = "suites/hidden.lua";
/// Sizes, px: the names at the left, a plot with its gap to the next, a row, and the heads and feet of the plots.
const NAMES: f32 = 322.0;
const PLOT: f32 = 320.0;
const GAP: f32 = 56.0;
const ROW: f32 = 26.0;
const TOP: f32 = 40.0;
const BOTTOM: f32 = 52.0;
const FONT_SIZE: f32 = 13.0;

pub fn svg(root: &Path) -> Result<String, String> {
    let (mut shown, labels) = (rows::read(root)?, rows::labels(root)?);
    shown.retain(|row| row.script == SCRIPT);
    let mut suites: Vec<&str> = shown.iter().map(|row| row.suite.as_str()).collect();
    suites.dedup();
    let names: Vec<&str> = shown
        .iter()
        .filter(|row| Some(&row.suite.as_str()) == suites.first())
        .map(|row| row.controller.as_str())
        .collect();
    let base = TOP + ROW * names.len() as f32;
    let mut drawn = Vec::new();
    for (row, name) in names.iter().enumerate() {
        let label = labels.get(*name).map_or_else(|| (*name).to_owned(), |words| format!("{name}: {words}"));
        drawn.push(text(at(NAMES - 18.0, middle(row) + 4.5), Anchor::End, label));
    }
    for (number, suite) in suites.iter().enumerate() {
        let left = NAMES + number as f32 * (PLOT + GAP);
        let title = suite.replace('_', " ");
        drawn.push(styled_text(at(left, 20.0), Anchor::Start, Font::Title, title));
        drawn.extend(axis(left, base));
        for (place, name) in names.iter().enumerate() {
            let row = shown.iter().find(|row| row.suite == *suite && row.controller == *name);
            drawn.extend(row.map_or_else(Vec::new, |row| dumbbell(left, middle(place), row)));
        }
    }
    let key = base + 42.0;
    let safety = "Safety Success, with its 95 % interval; the line is the gap";
    drawn.extend([
        goal_mark(at(NAMES + 6.0, key - 4.5)),
        text(at(NAMES + 18.0, key), Anchor::Start, "Goal Success"),
        safety_mark(at(NAMES + 136.0, key - 4.5)),
        text(at(NAMES + 148.0, key), Anchor::Start, safety),
    ]);
    let width = NAMES + suites.len() as f32 * (PLOT + GAP) - GAP + 24.0;
    let label = "Goal and Safety Success of each controller in the hidden suites";
    Ok(svg::image(width, base + BOTTOM, FONT_SIZE, label, &drawn))
}

fn goal_mark(place: Place) -> Element {
    Element::Symbol(place, Symbol::RING.with_radius(5.0))
}

fn safety_mark(place: Place) -> Element {
    Element::Symbol(place, Symbol::DOT.with_radius(4.5))
}

/// Height of the middle of a row.
fn middle(row: usize) -> f32 {
    TOP + ROW * (row as f32 + 0.5)
}

/// Place of a rate on an axis.
fn x(left: f32, percent: f64) -> f32 {
    left + 0.01 * percent as f32 * PLOT
}

fn axis(left: f32, base: f32) -> Vec<Element> {
    let ticks = [0.0, 25.0, 50.0, 75.0, 100.0].map(|percent| {
        let (x, faint) = (x(left, percent), Font::Plain(Tone::Faint));
        let label = styled_text(at(x, base + 17.0), Anchor::Middle, faint, format!("{percent} %"));
        [line(at(x, TOP), at(x, base), Stroke::Grid), label]
    });
    ticks.into_iter().flatten().collect()
}

fn dumbbell(left: f32, y: f32, row: &Row) -> Vec<Element> {
    let (Some(goal), Some(safety)) = (row.goal.rate, row.safety.rate) else { return Vec::new() };
    let (goal, safety) = (x(left, goal), x(left, safety));
    let band = row.safety.wilson95.map(|ends| {
        let [left, right] = ends.map(|end| x(left, end));
        Element::Area(Area { left, top: y - 8.0, right, bottom: y + 8.0 }, Fill::Band)
    });
    let gap = line(at(safety, y), at(goal, y), Stroke::Gap);
    band.into_iter().chain([gap, goal_mark(at(goal, y)), safety_mark(at(safety, y))]).collect()
}
