//! The safe interaction envelope of an asset as a plot of D over the width.

use softvt_evaluation::{
    calibration::{Envelope, HoldRow, SafeWindow, SweepRow, WindowEnd},
    safety::DeformationLimit,
};
use softvt_media::{
    axis::Axis,
    chart::{Chart, ChartPoint, Curve, Layout, Margins, Mark, SINGLE_CURVE, text_image},
    drawing::Symbol,
};

/// The image, with space for the ends of the window above the chart.
const LAYOUT: Layout = Layout {
    panel: [640.0, 340.0],
    margins: Margins { top: 62.0, ..Layout::SINGLE.margins },
    ..Layout::SINGLE
};

/// Plots D over the width as SVG: stable squeezes as dots, unstable ones as rings, peak D of hold trials as diamonds
/// (filled if every trial held), τ and D_ref as dashed lines, and the safe window as a band. Widths decrease to the
/// right, as the pads close.
pub fn envelope_plot(asset: &str, envelope: &Envelope, limit: Option<DeformationLimit>) -> String {
    let finite = |row: &&SweepRow| row.d_pct.is_finite() && row.width_mm.is_finite();
    let rows: Vec<&SweepRow> = envelope.sweep.iter().filter(finite).collect();
    let widths = || rows.iter().map(|row| row.width_mm).chain(envelope.window.loose.width_mm);
    let (widest, narrowest) =
        (widths().fold(f64::NEG_INFINITY, f64::max), widths().fold(f64::INFINITY, f64::min));
    if widest < narrowest {
        return text_image(&format!("{asset}: no rows"));
    }
    let held = envelope.holds.iter().filter(|row| row.all_held()).filter_map(|row| row.d_peak_pct);
    let d_max = rows.iter().map(|row| row.d_pct).chain(held).fold(0.0, f64::max);
    let d_max = d_max.max(limit.map_or(0.0, |limit| limit.d_ref_pct));
    let top = 1.05 * d_max.max(1e-9);
    let widest = if widest > narrowest { widest } else { widest + 1.0 };
    let has_carried = envelope.holds.iter().any(|row| row.d_peak_pct.is_some());
    let trials = if has_carried { " · diamonds: lifted and held" } else { "" };
    let objection = limit.filter(|limit| envelope.exceeds_when_carried(*limit)).map(|_| "pressed only");
    let verdict = if objection.is_some() { ": cannot be carried below τ" } else { "" };
    // Failed trials beyond the axes are left out.
    let carried = |row: &HoldRow| {
        let y = row.d_peak_pct.filter(|d| *d <= top && row.width_mm <= widest)?;
        Some(ChartPoint { x: row.width_mm, y, symbol: Some(Symbol::DIAMOND.filled(row.all_held())) })
    };
    let squeezed = |row: &&SweepRow| ChartPoint {
        x: row.width_mm,
        y: row.d_pct,
        symbol: Some(Symbol::DOT.filled(row.stable)),
    };
    let curve =
        Curve { points: rows.iter().map(squeezed).collect(), stroke: Some(SINGLE_CURVE), ..Curve::default() };
    let diamonds = Curve { points: envelope.holds.iter().filter_map(carried).collect(), ..Curve::default() };
    let mut marks: Vec<Mark> = band(&envelope.window, objection).into_iter().collect();
    marks.extend(limit.map_or_else(Vec::new, limit_levels));
    marks.extend([Mark::Curve(curve), Mark::Curve(diamonds)]);
    marks.extend(window_ends(&envelope.window));
    let chart = Chart {
        title: format!("{asset}{verdict}{trials}"),
        x: Axis::linear("width between the gels, mm (closing to the right)", widest, narrowest, 6),
        y: Axis::linear("D, % of the diagonal", 0.0, top, 5).with_grid(),
        marks,
    };
    LAYOUT.svg(&chart.title, std::slice::from_ref(&chart))
}

fn band(window: &SafeWindow, objection: Option<&'static str>) -> Option<Mark> {
    window.extent_mm()?;
    Some(Mark::Band { from: window.loose.width_mm?, to: window.tight.width_mm?, objection })
}

fn limit_levels(limit: DeformationLimit) -> Vec<Mark> {
    let level = |d: f64, name: &str| Mark::Level { y: d, label: format!("{name} {d:.2} %") };
    vec![level(limit.tau_pct(), "τ"), level(limit.d_ref_pct, "D_ref")]
}

/// The two ends of the window with their widths and forces.
fn window_ends(window: &SafeWindow) -> Vec<Mark> {
    let end = |name: &str, WindowEnd { width_mm, force_n }: WindowEnd| {
        let (width, force) = width_mm.zip(force_n)?;
        Some(Mark::Guide { x: width, label: format!("{name}: {width:.1} mm, {force:.2} N") })
    };
    let ends = [end("loose", window.loose), end("tight", window.tight)];
    ends.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_evaluation::{calibration::CalibrationMeasurements, thresholds::ThresholdFile};

    fn calibrated() -> Envelope {
        let text = include_str!("../../../assets/calibration/braided_roll.json");
        let mut file = ThresholdFile::parse(text, "braided_roll.json").expect("a calibration");
        file.envelopes.remove("braided_roll").expect("its envelope")
    }

    fn plotted(envelope: &Envelope) -> String {
        envelope_plot("bun", envelope, envelope.limit(0.5))
    }

    #[test]
    fn the_plot_shows_band_limits_and_every_row() {
        let mut envelope = calibrated();
        let svg = plotted(&envelope);
        let count = |what: &str| svg.matches(what).count();
        assert_eq!(count("<circle"), envelope.sweep.len(), "{svg}");
        assert_eq!((count("class=\"limit\""), count("class=\"band\"")), (2, 1), "{svg}");
        for end in [envelope.window.loose, envelope.window.tight] {
            let (width, force) = (end.width_mm.unwrap(), end.force_n.unwrap());
            assert!(svg.contains(&format!("{width:.1} mm, {force:.2} N")), "{svg}");
        }
        let tau = envelope.limit(0.5).unwrap().tau_pct();
        assert!(svg.contains(&format!("τ {tau:.2} %")), "{svg}");
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"));
        envelope.window.tight = envelope.window.loose;
        assert_eq!(plotted(&envelope).matches("class=\"band\"").count(), 0, "an empty window has no band");
    }

    #[test]
    fn hold_trials_are_diamonds_and_the_axes_reach_to_all_that_held() {
        let mut envelope = calibrated();
        let diamonds = |envelope: &Envelope| plotted(envelope).matches("<polygon").count();
        let held = envelope.holds.iter().filter(|row| row.all_held()).count();
        assert!(held > 1 && held < envelope.holds.len());
        envelope.holds.iter_mut().for_each(|row| row.d_peak_pct = Some(0.1));
        assert_eq!(diamonds(&envelope), envelope.holds.len(), "every hold trial is plotted");
        let peak = |row: &HoldRow| Some(if row.all_held() { 9.0 } else { 99.0 });
        envelope.holds.iter_mut().for_each(|row| row.d_peak_pct = peak(row));
        assert_eq!(diamonds(&envelope), held);
    }

    #[test]
    fn a_window_in_which_nothing_can_be_carried_is_hatched() {
        let mut envelope = calibrated();
        assert!(!plotted(&envelope).contains("cannot be carried"));
        envelope.carried_d_pct = Some(1.0 + envelope.limit(0.5).unwrap().tau_pct());
        let svg = plotted(&envelope);
        assert!(svg.contains("cannot be carried below τ") && svg.contains("class=\"hatched\""), "{svg}");
        assert!(!svg.contains("class=\"band\""), "{svg}");
    }

    #[test]
    fn an_empty_or_single_row_envelope_is_plotted() {
        let empty = Envelope::new(CalibrationMeasurements::default(), 0.5);
        assert!(plotted(&empty).contains("bun: no rows"));
        let sweep = vec![calibrated().sweep[1].clone()];
        let single =
            Envelope::new(CalibrationMeasurements { sweep, ..CalibrationMeasurements::default() }, 0.5);
        let svg = plotted(&single);
        assert!(svg.contains("<circle") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
