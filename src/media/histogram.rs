//! Histograms as panels of one SVG image.

use super::{
    svg::{self, Anchor, Area, at, line, rect, text},
    ticks::{linear_ticks, tick_label, tick_step},
};

/// Width and height of a panel, px, and panels side by side.
const PANEL: [f64; 2] = [280.0, 190.0];
const COLUMNS: usize = 4;
/// Margins of a panel around its plotting area, px.
const LEFT: f64 = 52.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 38.0;
const FONT_SIZE: f64 = 11.0;
/// Ratio of the largest to the smallest count from which counts have a logarithmic axis.
const LOG_RATIO: f64 = 50.0;

/// Counts in bins of equal width.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram<'a> {
    /// Quantity, with its unit.
    pub title: &'a str,
    /// Lower end of the first bin.
    pub min: f64,
    /// Upper end of the last bin.
    pub max: f64,
    /// The counts.
    pub bins: &'a [usize],
}

/// An image of histograms.
pub fn svg(panels: &[Histogram]) -> String {
    let columns = panels.len().clamp(1, COLUMNS);
    let rows = panels.len().div_ceil(COLUMNS).max(1);
    let [width, height] = [PANEL[0] * columns as f64, PANEL[1] * rows as f64];
    let drawn: String = panels.iter().enumerate().map(|(index, panel)| draw(index, panel)).collect();
    let titles: Vec<&str> = panels.iter().map(|panel| panel.title).collect();
    svg::image(width, height, FONT_SIZE, &format!("Histograms of {}", titles.join(", ")), &drawn)
}

/// Share of the height at which a count is drawn.
struct CountAxis {
    largest: f64,
    is_log: bool,
}

impl CountAxis {
    fn of(bins: &[usize]) -> Self {
        let largest = bins.iter().copied().max().unwrap_or(1).max(1) as f64;
        let least = bins.iter().copied().filter(|count| *count > 0).min().unwrap_or(1) as f64;
        Self { largest, is_log: largest / least >= LOG_RATIO }
    }

    /// On a logarithmic axis a count of 1 has some height, and 0 none.
    fn share(&self, count: f64) -> f64 {
        match (self.is_log, count > 0.0) {
            (_, false) => 0.0,
            (true, true) => (1.0 + count).ln() / (1.0 + self.largest).ln(),
            (false, true) => count / self.largest,
        }
    }

    fn ticks(&self) -> Vec<f64> {
        if !self.is_log {
            let ticks = linear_ticks(0.0, self.largest, 3);
            return ticks.into_iter().filter(|tick| tick.fract() == 0.0).collect();
        }
        let powers = (0..).map(|power| 10f64.powi(power)).take_while(|tick| *tick <= self.largest);
        std::iter::once(0.0).chain(powers).collect()
    }
}

fn draw(index: usize, panel: &Histogram) -> String {
    let (x0, y0) = (PANEL[0] * (index % COLUMNS) as f64, PANEL[1] * (index / COLUMNS) as f64);
    let (left, right) = (x0 + LEFT, x0 + PANEL[0] - RIGHT);
    let (top, base) = (y0 + TOP, y0 + PANEL[1] - BOTTOM);
    let counts = CountAxis::of(panel.bins);
    let y = |count: f64| base - counts.share(count) * (base - top);
    // All values may be equal.
    let (min, max) =
        if panel.max > panel.min { (panel.min, panel.max) } else { (panel.min - 0.5, panel.max + 0.5) };
    let x = |value: f64| left + (value - min) / (max - min) * (right - left);
    let rows = counts.ticks().into_iter().map(|tick| {
        line(at(left, y(tick)), at(right, y(tick)), "grid")
            + &text(at(left - 5.0, y(tick) + 4.0), Anchor::End, "", &tick_label(tick, 1.0))
    });
    let width = (right - left) / panel.bins.len().max(1) as f64;
    let bars = panel.bins.iter().enumerate().filter(|(_, count)| **count > 0).map(|(bin, count)| {
        let top = y(*count as f64);
        let area =
            Area { x: left + width * bin as f64, y: top, width: (width - 1.0).max(0.5), height: base - top };
        rect(area, "bar")
    });
    let step = tick_step(max - min, 4);
    let columns = linear_ticks(min, max, 4).into_iter().map(|tick| {
        line(at(x(tick), base), at(x(tick), base + 4.0), "axis")
            + &text(at(x(tick), base + 16.0), Anchor::Middle, "", &tick_label(tick, step))
    });
    let drawn: String = rows.chain(bars).chain(columns).collect();
    let unit = if counts.is_log { "count, log" } else { "count" };
    drawn
        + &line(at(left, base), at(right, base), "axis")
        + &text(at(x0 + 12.0, y0 + 16.0), Anchor::Start, "title", panel.title)
        + &text(at(right, y0 + 16.0), Anchor::End, "soft", unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rare_values_beside_frequent_ones_are_seen_and_axes_have_round_numbers() {
        let even = svg(&[Histogram { title: "x (m)", min: -0.252, max: 0.264, bins: &[1, 2, 4] }]);
        assert_eq!(even.matches("class=\"bar\"").count(), 3);
        assert!(
            [">−0.2<", ">0.0<", ">0.2<", ">4<", ">count<"].iter().all(|label| even.contains(label)),
            "{even}"
        );
        let skewed = svg(&[Histogram { title: "D (%)", min: 0.0, max: 1.0, bins: &[10_000, 0, 1] }]);
        assert!(skewed.contains(">count, log<") && skewed.matches("class=\"bar\"").count() == 2, "{skewed}");
        let constant = svg(&[Histogram { title: "c", min: 2.0, max: 2.0, bins: &[0, 3, 0] }]);
        assert!(constant.contains(">2.0<") && !constant.contains("NaN"), "{constant}");
    }
}
