//! Goal and Safety of the controllers in the hidden suites: two marks with the gap between them.

#[path = "../results/rows.rs"]
mod rows;

use std::path::Path;

use rows::Row;
use softvt::media::svg::{self, Anchor, Area, at, circle, line, rect, text};

/// The image, from the root of the repository.
pub const IMAGE: &str = "docs/images/hidden.svg";
/// Script of the runs.
const SCRIPT: &str = "suites/hidden.lua";
/// Sizes, px: the names at the left, a plot with its gap to the next, a row, and the heads and feet of the plots.
const NAMES: f64 = 322.0;
const PLOT: f64 = 320.0;
const GAP: f64 = 56.0;
const ROW: f64 = 26.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 52.0;
const FONT_SIZE: f64 = 13.0;

/// The image.
///
/// # Errors
/// Results that cannot be read.
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
    let base = TOP + ROW * names.len() as f64;
    let mut drawn = String::new();
    for (row, name) in names.iter().enumerate() {
        let label = labels.get(*name).map_or_else(|| (*name).to_owned(), |words| format!("{name}: {words}"));
        drawn += &text(at(NAMES - 18.0, middle(row) + 4.5), Anchor::End, "", &label);
    }
    for (number, suite) in suites.iter().enumerate() {
        let left = NAMES + number as f64 * (PLOT + GAP);
        drawn += &text(at(left, 20.0), Anchor::Start, "title", &suite.replace('_', " "));
        drawn += &axis(left, base);
        for (place, name) in names.iter().enumerate() {
            let row = shown.iter().find(|row| row.suite == *suite && row.controller == *name);
            drawn += &row.map_or_else(String::new, |row| dumbbell(left, middle(place), row));
        }
    }
    let key = base + 42.0;
    drawn += &circle(at(NAMES + 6.0, key - 4.5), 5.0, "ring");
    drawn += &text(at(NAMES + 18.0, key), Anchor::Start, "", "Goal Success");
    drawn += &circle(at(NAMES + 136.0, key - 4.5), 4.5, "dot");
    drawn += &text(
        at(NAMES + 148.0, key),
        Anchor::Start,
        "",
        "Safety Success, with its 95 % interval; the line is the gap",
    );
    let width = NAMES + suites.len() as f64 * (PLOT + GAP) - GAP + 24.0;
    let label = "Goal and Safety Success of each controller in the hidden suites";
    Ok(svg::image(width, base + BOTTOM, FONT_SIZE, label, &drawn))
}

/// Height of the middle of a row.
fn middle(row: usize) -> f64 {
    TOP + ROW * (row as f64 + 0.5)
}

/// Place of a rate on an axis.
fn x(left: f64, percent: f64) -> f64 {
    left + 0.01 * percent * PLOT
}

fn axis(left: f64, base: f64) -> String {
    let ticks = [0.0, 25.0, 50.0, 75.0, 100.0].map(|percent| {
        line(at(x(left, percent), TOP), at(x(left, percent), base), "grid")
            + &text(at(x(left, percent), base + 17.0), Anchor::Middle, "soft", &format!("{percent} %"))
    });
    ticks.concat()
}

fn dumbbell(left: f64, y: f64, row: &Row) -> String {
    let (Some(goal), Some(safety)) = (row.goal.rate, row.safety.rate) else { return String::new() };
    let (goal, safety) = (x(left, goal), x(left, safety));
    let band = row.safety.wilson95.map_or_else(String::new, |ends| {
        let [from, to] = ends.map(|end| x(left, end));
        rect(Area { x: from, y: y - 8.0, width: to - from, height: 16.0 }, "band")
    });
    band + &line(at(safety, y), at(goal, y), "over")
        + &circle(at(goal, y), 5.0, "ring")
        + &circle(at(safety, y), 4.5, "dot")
}
