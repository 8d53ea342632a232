//! Goal and Safety of the controllers in the hidden suites: two marks with the gap between them.

use std::{fs, path::Path};

use serde_json::Value;
use softvt::media::svg::{self, Anchor, Area, at, circle, line, rect, text};

/// The image, from the root of the repository.
pub const IMAGE: &str = "docs/images/hidden.svg";
/// Results and words about the controllers.
const RESULTS: &str = "docs/results/hidden.json";
const LABELS: &str = "docs/results/labels.json";
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
    let (results, labels) = (json(root, RESULTS)?, json(root, LABELS)?);
    let suites = list(&results["suites"]);
    let names: Vec<&str> = suites.first().map_or_else(Vec::new, |suite| {
        list(&suite["controllers"]).iter().filter_map(|cell| cell["name"].as_str()).collect()
    });
    let base = TOP + ROW * names.len() as f64;
    let mut drawn = String::new();
    for (row, name) in names.iter().enumerate() {
        let label =
            labels[*name].as_str().map_or_else(|| (*name).to_owned(), |words| format!("{name}: {words}"));
        drawn += &text(at(NAMES - 18.0, middle(row) + 4.5), Anchor::End, "", &label);
    }
    for (number, suite) in suites.iter().enumerate() {
        let left = NAMES + number as f64 * (PLOT + GAP);
        let title = suite["name"].as_str().unwrap_or_default().replace('_', " ");
        drawn += &text(at(left, 20.0), Anchor::Start, "title", &title);
        drawn += &axis(left, base);
        for (row, name) in names.iter().enumerate() {
            let cell = list(&suite["controllers"]).iter().find(|cell| cell["name"] == *name);
            drawn += &cell.map_or_else(String::new, |cell| dumbbell(left, middle(row), cell));
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

fn dumbbell(left: f64, y: f64, cell: &Value) -> String {
    let rate = |field: &str| cell[field]["rate"].as_f64().map(|percent| x(left, percent));
    let (Some(goal), Some(safety)) = (rate("goal_success_rate"), rate("safety_success_rate")) else {
        return String::new();
    };
    let bounds: Vec<f64> =
        list(&cell["safety_success_rate"]["wilson95"]).iter().filter_map(Value::as_f64).collect();
    let band = match bounds[..] {
        [low, high] => {
            let (from, to) = (x(left, low), x(left, high));
            rect(Area { x: from, y: y - 8.0, width: to - from, height: 16.0 }, "band")
        }
        _ => String::new(),
    };
    band + &line(at(safety, y), at(goal, y), "over")
        + &circle(at(goal, y), 5.0, "ring")
        + &circle(at(safety, y), 4.5, "dot")
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn json(root: &Path, path: &str) -> Result<Value, String> {
    let text = fs::read_to_string(root.join(path)).map_err(|error| format!("{path}: {error}"))?;
    serde_json::from_str(&text).map_err(|error| format!("{path}: {error}"))
}
