//! The safe interaction envelope of an asset as a plot of D over the width.

use softvt_evaluation::{
    calibration::{Envelope, HoldRow, SafeWindow, SweepRow},
    safety::DeformationLimit,
};
use softvt_media::plot::{
    AxisBand, HorizontalAxis, LabelSide, LevelLine, Plot, PlotPoint, VerticalMark, text_image,
};

/// Plots D over the width as SVG: stable squeezes as dots, unstable ones as rings, peak D of hold trials as diamonds
/// (filled if every trial held), τ and D_ref as dashed lines, and the safe window as a band. Widths decrease to the right,
/// as the pads close.
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
    let trials = if has_carried { "; diamonds: lifted and held" } else { "" };
    // Failed trials beyond the axes are left out.
    let carried = |row: &HoldRow| {
        let d_pct = row.d_peak_pct.filter(|d| *d <= top && row.width_mm <= widest)?;
        Some(PlotPoint { x: row.width_mm, y: d_pct, is_filled: row.all_held() })
    };
    let squeezed = |row: &&SweepRow| PlotPoint { x: row.width_mm, y: row.d_pct, is_filled: row.stable };
    Plot {
        title: format!("{asset}: D over the width between the gels{trials}"),
        x: HorizontalAxis {
            label: "width, mm (closing to the right)".to_owned(),
            left: widest,
            right: narrowest,
        },
        top,
        zero: "0 %".to_owned(),
        band: band(&envelope.window),
        levels: limit.map_or_else(Vec::new, limit_levels),
        curve: rows.iter().map(squeezed).collect(),
        diamonds: envelope.holds.iter().filter_map(carried).collect(),
        marks: window_ends(&envelope.window),
    }
    .svg()
}

fn band(window: &SafeWindow) -> Option<AxisBand> {
    window.extent_mm()?;
    Some(AxisBand { left: window.loose.width_mm?, right: window.tight.width_mm? })
}

fn limit_levels(limit: DeformationLimit) -> Vec<LevelLine> {
    let level = |d: f64, name: &str| LevelLine { y: d, label: format!("{name} {d:.2} %") };
    vec![level(limit.tau_pct(), "τ"), level(limit.d_ref_pct, "")]
}

/// The two ends of the window with their widths and forces.
fn window_ends(window: &SafeWindow) -> Vec<VerticalMark> {
    let end = |width: Option<f64>, force: Option<f64>, side: LabelSide| {
        let (width, force) = width.zip(force)?;
        Some(VerticalMark { x: width, label: format!("{width:.1} mm, {force:.2} N"), side })
    };
    let ends = [
        end(window.loose.width_mm, window.loose.force_n, LabelSide::Left),
        end(window.tight.width_mm, window.tight.force_n, LabelSide::Right),
    ];
    ends.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_evaluation::calibration::CalibrationMeasurements;

    /// A sweep from 50 mm whose third squeeze is not stable, and hold trials that hold from 48 mm inward or wider.
    fn measurements(widest_held_mm: f64) -> CalibrationMeasurements {
        let row = |width_mm: f64, d_pct: f64, stable: bool| SweepRow {
            width_mm,
            closure: None,
            d_pct,
            d_v1_pct: Some(1.2 * d_pct),
            force_n: 0.5 * (50.0 - width_mm),
            strain_p95: Some(0.1 * d_pct),
            min_det_f: 0.6,
            node_speed_m_s: 1e-4,
            both_pads: true,
            slip_mm: 0.0,
            stable,
        };
        let hold = |width_mm: f64| {
            let held = if width_mm <= widest_held_mm { 5 } else { 2 };
            HoldRow { width_mm, closure: None, trials: 5, held, slip_mm: 0.1, d_peak_pct: None }
        };
        CalibrationMeasurements {
            stable_strain: Some(0.3),
            holds: [49.0, 48.0, 47.0, 46.0].map(hold).into(),
            sweep: vec![
                row(50.0, 0.0, true),
                row(48.0, 1.0, true),
                row(46.0, 2.0, true),
                row(44.0, 10.0 / 3.0, true),
            ],
            ..CalibrationMeasurements::default()
        }
    }

    fn plotted(measurements: CalibrationMeasurements) -> String {
        let envelope = Envelope::new(measurements, 0.5);
        envelope_plot("bun", &envelope, envelope.limit(0.5))
    }

    #[test]
    fn the_plot_shows_band_limits_and_every_row() {
        let svg = plotted(measurements(48.0));
        let count = |what: &str| svg.matches(what).count();
        assert_eq!((count("<circle"), count("stroke-dasharray"), count("#d9efd9")), (4, 2, 1), "{svg}");
        assert!(
            svg.contains("48.0 mm, 1.00 N") && svg.contains("47.0 mm, 1.50 N") && svg.contains("τ 1.50 %")
        );
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"));
        let empty = plotted(measurements(46.0));
        assert_eq!(empty.matches("#d9efd9").count(), 0, "an empty window has no band");
    }

    #[test]
    fn hold_trials_are_diamonds_and_the_axes_reach_to_all_that_held() {
        let mut bending = measurements(48.0);
        bending.holds.iter_mut().for_each(|row| row.d_peak_pct = Some(1.6));
        assert_eq!(plotted(bending.clone()).matches("<polygon").count(), 4, "every hold trial is plotted");
        let peak = |row: &HoldRow| Some(if row.held == row.trials { 9.0 } else { 99.0 });
        bending.holds.iter_mut().for_each(|row| row.d_peak_pct = peak(row));
        assert_eq!(plotted(bending).matches("<polygon").count(), 3);
    }

    #[test]
    fn an_empty_or_single_row_envelope_is_plotted() {
        assert!(plotted(CalibrationMeasurements::default()).contains("bun: no rows"));
        let sweep = vec![measurements(48.0).sweep[1].clone()];
        let svg = plotted(CalibrationMeasurements { sweep, ..CalibrationMeasurements::default() });
        assert!(svg.contains("<circle") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
