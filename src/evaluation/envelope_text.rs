//! The safe interaction envelope of an asset in three lines of text.

use super::{
    calibration::{Envelope, SweepProtocol},
    safety::DeformationLimit,
};

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
    let loose = match window.loose.width_mm {
        Some(lower) => format!("it holds from {lower:.2} mm inward"),
        None if envelope.holds.is_empty() => "no hold trial was run".to_owned(),
        None => "no width held in every trial".to_owned(),
    };
    let tight = match window.tight.width_mm {
        Some(tight) => format!("D passes τ at {tight:.2} mm"),
        None if limit.is_none() => "there is no τ".to_owned(),
        None => "the sweep does not reach τ".to_owned(),
    };
    match (window.loose.width_mm, window.tight.width_mm, window.extent_mm()) {
        (Some(lower), Some(tight), Some(extent)) if exceeds => format!(
            "held from {lower:.2} mm and pressed to τ at {tight:.2} mm of width ({extent:.2} mm), but D of the carried \
             object exceeds τ at every width ({:.3} % at least)",
            envelope.carried_d_pct.unwrap_or(f64::NAN)
        ),
        (Some(lower), Some(tight), Some(extent)) => format!(
            "safe between {lower:.2} and {tight:.2} mm of width ({extent:.2} mm), at {} to {} N per pad",
            newton(window.loose.force_n),
            newton(window.tight.force_n)
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
        (SweepProtocol::Hand, ..) => "squeezed by the robot's hand: D_ref is the largest stable D".to_owned(),
        (SweepProtocol::Press, None, Some(strain)) => {
            format!("pressed until 5 % of the volume was beyond the stable strain {strain}")
        }
        (SweepProtocol::Press, None, None) => "pressed to the end of the sweep".to_owned(),
        (SweepProtocol::Press, Some(reason), _) => {
            let bound = if envelope.d_ref_pct.is_some() { ", so D_ref is a lower bound" } else { "" };
            format!("censored: the press ended early ({reason}){bound}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::calibration::{
        CalibrationMeasurements,
        tests::{hold, scans},
    };
    use super::*;

    fn text(scans: CalibrationMeasurements) -> String {
        let envelope = Envelope::new(scans, 0.5);
        summary_text("bun", &envelope, envelope.limit(0.5))
    }

    #[test]
    fn three_lines_tell_window_limit_and_end() {
        assert_eq!(
            text(scans(48.0)),
            "bun: safe between 48.00 and 47.00 mm of width (1.00 mm), at 1.00 to 1.50 N per pad\n\
             τ 1.500 % of the diagonal = 0.5 × D_ref; D_ref 3.000 % at 44.50 mm\n\
             pressed until 5 % of the volume was beyond the stable strain 0.3\n"
        );
        let mut heavy = scans(48.0);
        heavy.holds.iter_mut().for_each(|row| row.d_peak_pct = Some(1.6));
        let heavy = text(heavy);
        assert!(heavy.contains("carried object exceeds τ at every width (1.600 % at least)"), "{heavy}");
        let narrow =
            text(CalibrationMeasurements { holds: vec![hold(47.01, 5), hold(48.0, 2)], ..scans(48.0) });
        assert!(narrow.contains("47.00 mm; 0.010 mm are less than the accuracy of its ends"), "{narrow}");
        let untried = text(CalibrationMeasurements { holds: vec![], ..scans(48.0) });
        assert!(untried.contains("no safe window: no hold trial was run, and D passes τ"), "{untried}");
        let empty = text(scans(46.0));
        assert!(empty.contains("it holds from 46.00 mm inward, and D passes τ at 47.00 mm"), "{empty}");
        let censored = text(CalibrationMeasurements { stable_strain: None, ..scans(48.0) });
        assert!(
            censored.contains("censored: the press ended early (the material states no collapse_strain)")
        );
        let hand = text(CalibrationMeasurements { protocol: SweepProtocol::Hand, ..scans(48.0) });
        assert!(hand.contains("by the robot's hand"), "{hand}");
        assert!(text(CalibrationMeasurements::default()).contains("no τ: no squeeze was stable"));
    }
}
