//! The claims of `docs/validation.md` as dots: the worst result of each over its bound.

use std::{collections::BTreeMap, fs, path::Path};

use softvt::media::{
    drawing::{Anchor, Element, Font, Place, Stroke, Symbol, Tone, at, line, styled_text, text},
    svg,
};

/// The image, and the page with the claims, from the root of the repository.
pub const IMAGE: &str = "docs/images/validation.svg";
const PAGE: &str = "docs/validation.md";
/// Sizes, px: the plot and its margins, and the radius of a dot.
const LEFT: f32 = 40.0;
const PLOT: f32 = 760.0;
const RIGHT: f32 = 24.0;
const TOP: f32 = 26.0;
const BOTTOM: f32 = 48.0;
const RADIUS: f32 = 4.0;
/// Width of a column of dots, and height of a dot in it, px.
const PITCH: f32 = 2.2 * RADIUS;
const FONT_SIZE: f32 = 12.0;
/// Powers of ten at the ends of the axis of worst over bound. Smaller shares are drawn at the left end.
const POWERS: [i32; 2] = [-9, 2];

/// The image: dots in piles, rings for missed bounds.
pub fn svg(root: &Path) -> Result<String, String> {
    let page = fs::read_to_string(root.join(PAGE)).map_err(|error| format!("{PAGE}: {error}"))?;
    let shares = shares(&page);
    if shares.is_empty() {
        return Err(format!("{PAGE}: no claims with bounds under ## Summary"));
    }
    let mut piles = BTreeMap::new();
    let places: Vec<Place> = shares.iter().map(|share| pile(*share, &mut piles)).collect();
    let highest = piles.values().max().copied().unwrap_or(0) as f32 * PITCH;
    let base = TOP + highest + 2.0 * RADIUS;
    let mut drawn = axis(base);
    for (share, place) in shares.iter().zip(places) {
        let centre = at(place.x, base - place.y);
        drawn.push(Element::Symbol(centre, Symbol::DOT.with_radius(RADIUS).filled(*share <= 1.0)));
    }
    let reached = shares.iter().filter(|share| **share <= 1.0).count();
    let said = format!("{reached} of {} results are within their bound; rings are the others", shares.len());
    drawn.push(styled_text(at(LEFT, 16.0), Anchor::Start, Font::Title, &said));
    Ok(svg::image(LEFT + PLOT + RIGHT, base + BOTTOM, FONT_SIZE, &said, &drawn))
}

/// The worst result over its bound, of every claim of the summary that has a bound above 0.
fn shares(page: &str) -> Vec<f64> {
    let (_, summary) = page.split_once("## Summary").unwrap_or_default();
    let summary = summary.split("\n## ").next().unwrap_or_default();
    let share = |row: &str| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [_, worst, bound, _] = cells[..] else { return None };
        let bound: f64 = bound.parse().ok().filter(|bound| *bound > 0.0)?;
        Some(worst.parse::<f64>().ok()? / bound)
    };
    summary.lines().filter_map(share).collect()
}

/// Place of the next dot at a share, px from the left and above the axis: on the pile of its column. The bound
/// is between two columns.
fn pile(share: f64, piles: &mut BTreeMap<i32, usize>) -> Place {
    let offset = (x(share) - x(1.0)) / PITCH;
    let column = if share > 1.0 { offset.floor().max(0.0) } else { (offset.ceil() - 1.0).min(-1.0) };
    let count = piles.entry(column as i32).or_insert(0);
    *count += 1;
    at(x(1.0) + (column + 0.5) * PITCH, (*count as f32 - 0.5) * PITCH)
}

fn x(share: f64) -> f32 {
    let [low, high] = POWERS.map(f64::from);
    let power = share.max(f64::MIN_POSITIVE).log10().clamp(low, high);
    LEFT + PLOT * ((power - low) / (high - low)) as f32
}

fn axis(base: f32) -> Vec<Element> {
    let mut drawn = vec![line(at(LEFT, base), at(LEFT + PLOT, base), Stroke::Axis)];
    for power in (POWERS[0]..=POWERS[1]).filter(|power| power % 2 == 0 || *power == POWERS[0]) {
        let place = x(10f64.powi(power));
        let label = match power {
            0 => "1".to_owned(),
            2 => "100".to_owned(),
            power if power == POWERS[0] => format!("≤ 1e−{}", -power),
            power => format!("1e−{}", -power),
        };
        drawn.push(line(at(place, base), at(place, base + 4.0), Stroke::Axis));
        let faint = Font::Plain(Tone::Faint);
        drawn.push(styled_text(at(place, base + 18.0), Anchor::Middle, faint, label));
    }
    let limit = x(1.0);
    drawn.push(line(at(limit, TOP), at(limit, base), Stroke::Limit));
    drawn.push(text(at(limit + 6.0, TOP + 10.0), Anchor::Start, "bound"));
    drawn.push(text(at(LEFT + 0.5 * PLOT, base + 38.0), Anchor::Middle, "worst result over its bound"));
    drawn
}
