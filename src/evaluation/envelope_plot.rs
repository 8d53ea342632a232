//! Plain-text plot of the safe interaction envelope of an asset: D over closure, with the lower bound and τ.

use super::{
    calibration::{Envelope, HoldRow},
    safety::DeformationLimit,
};

/// Columns of the plot without labels.
const WIDTH: usize = 72;
/// Rows of the plot without axis.
const HEIGHT: usize = 12;
/// Columns of the labels to the left of the plot.
const MARGIN: usize = 9;

/// Horizontal axis: closures from `low` to `high`.
struct PlotAxis {
    low: f64,
    high: f64,
}

impl PlotAxis {
    fn column(&self, closure: f64) -> usize {
        let share = ((closure - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        (share * (WIDTH - 1) as f64).round() as usize
    }

    fn closure(&self, column: usize) -> f64 {
        self.low + (self.high - self.low) * column as f64 / (WIDTH - 1) as f64
    }
}

/// Plots the envelope of `asset` in lines of less than 100 columns.
///
/// Stable squeezes are `●`, unstable ones `○`, and τ is a dashed line. Below are the holds of the lower-bound scan
/// (`+` all trials held, `~` some, `-` none) and the zones: too loose `░`, safe `█`, too tight `▓`.
pub fn plot(asset: &str, envelope: &Envelope, limit: Option<DeformationLimit>) -> String {
    let holds = envelope.holds.iter().map(|row| row.closure);
    let closures = envelope.sweep.iter().map(|row| row.closure).chain(holds);
    let (low, high) = closures.fold((f64::MAX, f64::MIN), |(low, high), c| (low.min(c), high.max(c)));
    if low > high {
        return format!("{asset}: no rows, nothing to plot\n");
    }
    let axis = PlotAxis { low, high: if high > low { high } else { low + 0.01 } };
    let heading = limit.map_or_else(
        || format!("{asset} · no stable squeeze, no threshold"),
        |limit| {
            let DeformationLimit { d_ref_pct, kappa } = limit;
            format!("{asset} · D_ref {d_ref_pct:.3} % · τ {:.3} % (κ {kappa})", limit.tau_pct())
        },
    );
    let mut lines = vec![heading];
    lines.extend(curve(envelope, limit, &axis));
    lines.push(labelled("hold", &hold_marks(&envelope.holds, &axis)));
    lines.push(labelled("zone", &zones(envelope, &axis)));
    lines.push(labelled("closure", &ticks(&axis)));
    lines.push(conclusion(envelope));
    lines.iter().map(|line| format!("{}\n", line.trim_end())).collect()
}

fn curve(envelope: &Envelope, limit: Option<DeformationLimit>, axis: &PlotAxis) -> Vec<String> {
    let peak = envelope.sweep.iter().map(|row| row.d_peak_pct).fold(0.0_f64, f64::max);
    // The unstable tail may be many times D_ref; cut the plot at twice D_ref, below which everything of interest lies.
    let top = limit.map_or(peak, |limit| peak.min(2.0 * limit.d_ref_pct)).max(1e-9);
    let line_of = |d: f64| {
        let share = (d / top).clamp(0.0, 1.0);
        HEIGHT - 1 - (share * (HEIGHT - 1) as f64).round() as usize
    };
    let mut grid = vec![vec![' '; WIDTH]; HEIGHT];
    let tau_line = limit.map(|limit| line_of(limit.tau_pct()));
    if let Some(line) = tau_line {
        grid[line].fill('╌');
    }
    for row in &envelope.sweep {
        let mark = if row.stable { '●' } else { '○' };
        grid[line_of(row.d_peak_pct)][axis.column(row.closure)] = mark;
    }
    let label = |line: usize| match line {
        _ if Some(line) == tau_line => "τ".to_owned(),
        0 => format!("{top:.2} %"),
        _ if line == HEIGHT - 1 => "0 %".to_owned(),
        _ => String::new(),
    };
    grid.iter().enumerate().map(|(i, row)| labelled(&label(i), &row.iter().collect::<String>())).collect()
}

fn hold_marks(rows: &[HoldRow], axis: &PlotAxis) -> String {
    let mut line = vec![' '; WIDTH];
    for row in rows {
        line[axis.column(row.closure)] = match row.held {
            held if held == row.trials && row.trials > 0 => '+',
            0 => '-',
            _ => '~',
        };
    }
    line.into_iter().collect()
}

fn zones(envelope: &Envelope, axis: &PlotAxis) -> String {
    let loose = |closure: f64| envelope.closure_lower.is_none_or(|lower| closure < lower);
    let tight = |closure: f64| envelope.closure_at_tau.is_some_and(|upper| closure > upper);
    (0..WIDTH)
        .map(|column| axis.closure(column))
        .map(|closure| match (loose(closure), tight(closure)) {
            (_, true) => '▓',
            (true, false) => '░',
            (false, false) => '█',
        })
        .collect()
}

fn ticks(axis: &PlotAxis) -> String {
    let mut line = String::new();
    for column in (0..WIDTH).step_by((WIDTH - 1) / 5) {
        let text = format!("{:.2}", axis.closure(column));
        line.extend(std::iter::repeat_n(' ', column.saturating_sub(line.len())));
        line.push_str(&text);
    }
    line
}

fn conclusion(envelope: &Envelope) -> String {
    let loose = "░ too loose";
    let tight = "▓ too tight";
    match (envelope.closure_lower, envelope.closure_at_tau) {
        (Some(lower), Some(upper)) if lower < upper => {
            format!("{loose} < {lower:.3} ≤ █ safe window ≤ {upper:.3} < {tight}")
        }
        (Some(lower), Some(upper)) => {
            format!("{loose} {tight}: no safe window: it holds from {lower:.3}, D passes τ at {upper:.3}")
        }
        (Some(lower), None) => format!("{loose} < {lower:.3} ≤ █ safe window; the sweep does not cross τ"),
        (None, _) => format!("{loose} {tight}: no safe window: no closure held in every trial"),
    }
}

fn labelled(label: &str, text: &str) -> String {
    format!("{label:>MARGIN$} │{text}")
}

#[cfg(test)]
mod tests {
    use super::super::calibration::{
        deformation_limit,
        tests::{hold, squeeze},
    };
    use super::*;

    fn envelope(lower: f64) -> Envelope {
        let holds =
            (0..6).map(|i| 0.30 + 0.02 * f64::from(i)).map(|c| hold(c, if c >= lower { 5 } else { 2 }));
        let sweep =
            (0..16).map(|i| 0.30 + 0.02 * f64::from(i)).map(|c| squeeze(c, 10.0 * (c - 0.3), c < 0.55));
        Envelope::new(holds.collect(), sweep.collect(), 0.5)
    }

    fn plotted(lower: f64) -> String {
        let envelope = envelope(lower);
        plot("bun", &envelope, deformation_limit(&envelope.sweep, 0.5))
    }

    #[test]
    fn the_plot_shows_the_three_zones_in_order_and_fits_the_screen() {
        let text = plotted(0.33);
        assert!(text.lines().all(|line| line.chars().count() < 100), "{text}");
        let zone = text.lines().find(|line| line.contains("zone")).unwrap();
        let mut marks_in_order: Vec<char> = zone.chars().filter(|c| "░█▓".contains(*c)).collect();
        // Closures 0.30..0.60: loose below 0.34, safe up to D = τ = 1.2 at 0.42.
        let count = |c: char| marks_in_order.iter().filter(|s| **s == c).count();
        assert_eq!((count('░'), count('█'), count('▓')), (10, 19, 43));
        marks_in_order.dedup();
        assert_eq!(marks_in_order, ['░', '█', '▓']);
        assert!(text.contains("░ too loose < 0.340 ≤ █ safe window ≤ 0.420 < ▓ too tight"), "{text}");
        let marks = |c: char| text.chars().filter(|m| *m == c).count();
        assert_eq!((marks('●'), marks('○')), (13, 3));
        assert!(text.contains("~   ") && text.contains('+'));
    }

    #[test]
    fn the_plot_reports_a_missing_safe_window() {
        let text = plotted(0.9);
        assert!(text.contains("no closure held in every trial") && !text.contains('█'), "{text}");
        let mut late = envelope(0.33);
        late.closure_lower = Some(0.5);
        assert!(
            plot("bun", &late, None).contains("no safe window: it holds from 0.500, D passes τ at 0.420")
        );
    }

    #[test]
    fn an_empty_or_single_row_envelope_is_plotted() {
        assert!(plot("bun", &Envelope::new(vec![], vec![], 0.5), None).contains("no rows"));
        let one = Envelope::new(vec![], vec![squeeze(0.4, 1.0, true)], 0.5);
        assert!(plot("bun", &one, None).contains('●'));
    }
}
