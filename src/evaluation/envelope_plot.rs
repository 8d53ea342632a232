//! The safe interaction envelope of an asset in three lines of text, and as an SVG plot of D over the width.

use super::{
    calibration::{Envelope, HoldRow, Protocol, SweepRow},
    safety::DeformationLimit,
};

/// Size of the image, px.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 300.0;
/// Margins around the plotting area, px.
const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 46.0;
/// Intervals between the labels of the width.
const TICKS: u32 = 5;

/// The envelope in three lines: the safe window, τ, and the end of the sweep.
pub fn summary_text(asset: &str, envelope: &Envelope, limit: Option<DeformationLimit>) -> String {
    format!(
        "{asset}: {}\n{}\n{}\n",
        window_line(envelope, limit),
        limit_line(envelope, limit),
        end_line(envelope)
    )
}

fn window_line(envelope: &Envelope, limit: Option<DeformationLimit>) -> String {
    let window = &envelope.window;
    let newton = |force: Option<f64>| force.map_or_else(|| "–".to_owned(), |force| format!("{force:.2}"));
    let exceeds = limit.is_some_and(|limit| envelope.exceeds_when_carried(limit));
    let loose = match window.width_lower_mm {
        Some(lower) => format!("it holds from {lower:.2} mm inward"),
        None if envelope.holds.is_empty() => "no hold trial was run".to_owned(),
        None => "no width held in every trial".to_owned(),
    };
    let tight = match window.width_at_tau_mm {
        Some(tight) => format!("D passes τ at {tight:.2} mm"),
        None if limit.is_none() => "there is no τ".to_owned(),
        None => "the sweep does not reach τ".to_owned(),
    };
    match (window.width_lower_mm, window.width_at_tau_mm, window.extent_mm()) {
        (Some(lower), Some(tight), Some(extent)) if exceeds => format!(
            "held from {lower:.2} mm and pressed to τ at {tight:.2} mm of width ({extent:.2} mm), but D of the carried \
             object exceeds τ at every width ({:.3} % at least)",
            envelope.carried_d_pct.unwrap_or(f64::NAN)
        ),
        (Some(lower), Some(tight), Some(extent)) => format!(
            "safe between {lower:.2} and {tight:.2} mm of width ({extent:.2} mm), at {} to {} N per pad",
            newton(window.force_lower_n),
            newton(window.force_at_tau_n)
        ),
        (Some(lower), Some(tight_mm), None) if lower > tight_mm => format!(
            "no safe window: {loose}, and {tight}; {:.3} mm are less than the accuracy of its ends",
            lower - tight_mm
        ),
        _ => format!("no safe window: {loose}, and {tight}"),
    }
}

fn limit_line(envelope: &Envelope, limit: Option<DeformationLimit>) -> String {
    let Some(limit) = limit else {
        let is_stable = envelope.sweep.iter().any(|row| row.stable);
        return if is_stable { "no τ: D_ref is unknown" } else { "no τ: no squeeze was stable" }.to_owned();
    };
    let DeformationLimit { d_ref_pct, kappa } = limit;
    let at = envelope.width_at_d_ref_mm.map_or_else(String::new, |width| format!(" at {width:.2} mm"));
    format!("τ {:.3} % of the diagonal = {kappa} × D_ref; D_ref {d_ref_pct:.3} %{at}", limit.tau_pct())
}

fn end_line(envelope: &Envelope) -> String {
    match (envelope.protocol, &envelope.censored, envelope.stable_strain) {
        (Protocol::Hand, ..) => "squeezed by the robot's hand: D_ref is the largest stable D".to_owned(),
        (Protocol::Press, None, Some(strain)) => {
            format!("pressed until 5 % of the volume was beyond the stable strain {strain}")
        }
        (Protocol::Press, None, None) => "pressed to the end of the sweep".to_owned(),
        (Protocol::Press, Some(reason), _) => {
            let bound = if envelope.d_ref_pct.is_some() { ", so D_ref is a lower bound" } else { "" };
            format!("censored: the press ended early ({reason}){bound}")
        }
    }
}

/// The axes: widths decrease to the right, as the pads close.
struct Axes {
    widest: f64,
    narrowest: f64,
    top: f64,
}

impl Axes {
    fn x(&self, width_mm: f64) -> f64 {
        let share = (self.widest - width_mm) / (self.widest - self.narrowest);
        LEFT + share.clamp(0.0, 1.0) * (WIDTH - LEFT - RIGHT)
    }

    fn y(&self, d_pct: f64) -> f64 {
        let share = (d_pct / self.top).clamp(0.0, 1.0);
        HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)
    }
}

/// Plots D over the width as SVG: stable squeezes as dots, unstable ones as rings, peak D of hold trials as diamonds
/// (filled if every trial held), τ and D_ref as dashed lines, and the safe window as a band.
pub fn plot(asset: &str, envelope: &Envelope, limit: Option<DeformationLimit>) -> String {
    let finite = |row: &&SweepRow| row.d_pct.is_finite() && row.width_mm.is_finite();
    let rows: Vec<&SweepRow> = envelope.sweep.iter().filter(finite).collect();
    let widths = || rows.iter().map(|row| row.width_mm).chain(envelope.window.width_lower_mm);
    let (widest, narrowest) =
        (widths().fold(f64::NEG_INFINITY, f64::max), widths().fold(f64::INFINITY, f64::min));
    let head = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
    );
    if widest < narrowest {
        return format!("{head}{}</svg>\n", text(LEFT, TOP, "start", &format!("{asset}: no rows")));
    }
    let held = envelope.holds.iter().filter(|row| row.all_held()).filter_map(|row| row.d_peak_pct);
    let d_max = rows.iter().map(|row| row.d_pct).chain(held).fold(0.0, f64::max);
    let d_max = d_max.max(limit.map_or(0.0, |limit| limit.d_ref_pct));
    let widest = if widest > narrowest { widest } else { widest + 1.0 };
    let axes = Axes { widest, narrowest, top: 1.05 * d_max.max(1e-9) };
    let trials = if has_carried(envelope) { "; diamonds: lifted and held" } else { "" };
    let title = format!("{asset}: D over the width between the gels{trials}");
    let parts = [
        band(&axes, envelope),
        frame(&axes),
        limit.map_or_else(String::new, |limit| limit_lines(&axes, limit)),
        curve(&axes, &rows),
        carried(&axes, &envelope.holds),
        window_ends(&axes, envelope),
        text(LEFT, 20.0, "start", &title),
    ];
    format!("{head}{}</svg>\n", parts.concat())
}

fn text(x: f64, y: f64, anchor: &str, what: &str) -> String {
    let escaped = what.replace('&', "&amp;").replace('<', "&lt;");
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{escaped}</text>\n")
}

fn line(x1: f64, y1: f64, x2: f64, y2: f64, style: &str) -> String {
    format!("<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>\n")
}

/// The safe window as a green band.
fn band(axes: &Axes, envelope: &Envelope) -> String {
    let window = &envelope.window;
    let (Some(lower), Some(tight), Some(_)) =
        (window.width_lower_mm, window.width_at_tau_mm, window.extent_mm())
    else {
        return String::new();
    };
    let (from, to) = (axes.x(lower), axes.x(tight));
    format!(
        "<rect x=\"{from:.1}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#d9efd9\"/>\n",
        to - from,
        HEIGHT - TOP - BOTTOM
    )
}

fn frame(axes: &Axes) -> String {
    let base = HEIGHT - BOTTOM;
    let black = "stroke=\"black\"";
    let tick = |k: u32| {
        let width = axes.widest - (axes.widest - axes.narrowest) * f64::from(k) / f64::from(TICKS);
        let x = axes.x(width);
        line(x, base, x, base + 4.0, black) + &text(x, base + 17.0, "middle", &format!("{width:.1}"))
    };
    let ticks: String = (0..=TICKS).map(tick).collect();
    let middle = LEFT + (WIDTH - LEFT - RIGHT) / 2.0;
    line(LEFT, base, WIDTH - RIGHT, base, black)
        + &line(LEFT, TOP, LEFT, base, black)
        + &ticks
        + &text(middle, HEIGHT - 10.0, "middle", "width, mm (closing to the right)")
        + &text(LEFT - 6.0, base, "end", "0 %")
}

fn limit_lines(axes: &Axes, limit: DeformationLimit) -> String {
    let dashed = "stroke=\"#b03030\" stroke-dasharray=\"5 4\"";
    let at = |d: f64, name: &str| {
        let y = axes.y(d);
        line(LEFT, y, WIDTH - RIGHT, y, dashed)
            + &text(LEFT - 6.0, y + 4.0, "end", &format!("{name} {d:.2} %"))
    };
    at(limit.tau_pct(), "τ") + &at(limit.d_ref_pct, "")
}

fn curve(axes: &Axes, rows: &[&SweepRow]) -> String {
    let at = |row: &SweepRow| format!("{:.1},{:.1}", axes.x(row.width_mm), axes.y(row.d_pct));
    let path: Vec<String> = rows.iter().map(|row| at(row)).collect();
    let marks = rows.iter().map(|row| {
        let fill = if row.stable { "#2050a0" } else { "white" };
        let (x, y) = (axes.x(row.width_mm), axes.y(row.d_pct));
        format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{fill}\" stroke=\"#2050a0\"/>\n")
    });
    let line = format!("<polyline points=\"{}\" fill=\"none\" stroke=\"#2050a0\"/>\n", path.join(" "));
    line + &marks.collect::<String>()
}

fn has_carried(envelope: &Envelope) -> bool {
    envelope.holds.iter().any(|row| row.d_peak_pct.is_some())
}

/// Peak D of the hold trials. Failed ones beyond the axes are left out.
fn carried(axes: &Axes, holds: &[HoldRow]) -> String {
    let marks = holds.iter().filter_map(|row| {
        let d_pct = row.d_peak_pct.filter(|d| *d <= axes.top && row.width_mm <= axes.widest)?;
        let fill = if row.all_held() { "#c07020" } else { "white" };
        let (x, y) = (axes.x(row.width_mm), axes.y(d_pct));
        let (left, right, top, bottom) = (x - 4.0, x + 4.0, y - 4.0, y + 4.0);
        Some(format!(
            "<polygon points=\"{left:.1},{y:.1} {x:.1},{top:.1} {right:.1},{y:.1} {x:.1},{bottom:.1}\" fill=\"{fill}\" \
             stroke=\"#c07020\"/>\n"
        ))
    });
    marks.collect()
}

/// The two ends of the window with their widths and forces.
fn window_ends(axes: &Axes, envelope: &Envelope) -> String {
    let window = &envelope.window;
    let end = |width: Option<f64>, force: Option<f64>, anchor: &str| {
        let (Some(width), Some(force)) = (width, force) else { return String::new() };
        let x = axes.x(width);
        line(x, TOP, x, HEIGHT - BOTTOM, "stroke=\"#308030\"")
            + &text(x, TOP - 2.0, anchor, &format!("{width:.1} mm, {force:.2} N"))
    };
    end(window.width_lower_mm, window.force_lower_n, "end")
        + &end(window.width_at_tau_mm, window.force_at_tau_n, "start")
}

#[cfg(test)]
mod tests {
    use super::super::calibration::{
        CalibrationMeasurements,
        tests::{hold, scans},
    };
    use super::*;

    fn shown(scans: CalibrationMeasurements) -> (String, String) {
        let envelope = Envelope::new(scans, 0.5);
        let limit = envelope.limit(0.5);
        (summary_text("bun", &envelope, limit), plot("bun", &envelope, limit))
    }

    #[test]
    fn three_lines_tell_window_limit_and_end() {
        let (text, _) = shown(scans(48.0));
        assert_eq!(
            text,
            "bun: safe between 48.00 and 47.00 mm of width (1.00 mm), at 1.00 to 1.50 N per pad\n\
             τ 1.500 % of the diagonal = 0.5 × D_ref; D_ref 3.000 % at 44.50 mm\n\
             pressed until 5 % of the volume was beyond the stable strain 0.3\n"
        );
        let mut heavy = scans(48.0);
        heavy.holds.iter_mut().for_each(|row| row.d_peak_pct = Some(1.6));
        let (heavy, svg) = shown(heavy);
        assert!(heavy.contains("carried object exceeds τ at every width (1.600 % at least)"), "{heavy}");
        assert_eq!(svg.matches("<polygon").count(), 4, "every hold trial is plotted");
        let mut bending = scans(48.0);
        bending
            .holds
            .iter_mut()
            .for_each(|row| row.d_peak_pct = Some(if row.all_held() { 9.0 } else { 99.0 }));
        let held = bending.holds.iter().filter(|row| row.all_held()).count();
        let (_, svg) = shown(bending);
        assert_eq!(svg.matches("<polygon").count(), held, "the axes reach to all that held");
        let (narrow, _) =
            shown(CalibrationMeasurements { holds: vec![hold(47.01, 5), hold(48.0, 2)], ..scans(48.0) });
        assert!(narrow.contains("47.00 mm; 0.010 mm are less than the accuracy of its ends"), "{narrow}");
        let (untried, _) = shown(CalibrationMeasurements { holds: vec![], ..scans(48.0) });
        assert!(untried.contains("no safe window: no hold trial was run, and D passes τ"), "{untried}");
        let (empty, _) = shown(scans(46.0));
        assert!(empty.contains("it holds from 46.00 mm inward, and D passes τ at 47.00 mm"), "{empty}");
        let (censored, _) = shown(CalibrationMeasurements { stable_strain: None, ..scans(48.0) });
        assert!(
            censored.contains("censored: the press ended early (the material states no collapse_strain)")
        );
        let (hand, _) = shown(CalibrationMeasurements { protocol: Protocol::Hand, ..scans(48.0) });
        assert!(hand.contains("by the robot's hand"), "{hand}");
    }

    #[test]
    fn the_plot_shows_band_limits_and_every_row() {
        let (_, svg) = shown(scans(48.0));
        let count = |what: &str| svg.matches(what).count();
        assert_eq!((count("<circle"), count("stroke-dasharray"), count("#d9efd9")), (4, 2, 1), "{svg}");
        assert!(
            svg.contains("48.0 mm, 1.00 N") && svg.contains("47.0 mm, 1.50 N") && svg.contains("τ 1.50 %")
        );
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"));
        let (_, empty) = shown(scans(46.0));
        assert_eq!(empty.matches("#d9efd9").count(), 0, "an empty window has no band");
    }

    #[test]
    fn an_empty_or_single_row_envelope_is_plotted() {
        let (text, svg) = shown(CalibrationMeasurements::default());
        assert!(text.contains("no τ: no squeeze was stable") && svg.contains("no rows"), "{text}");
        let one = CalibrationMeasurements {
            sweep: vec![scans(48.0).sweep[1].clone()],
            ..CalibrationMeasurements::default()
        };
        let (_, svg) = shown(one);
        assert!(svg.contains("<circle") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
