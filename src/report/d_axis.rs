//! The logarithmic axis of D/τ, the same for all figures and for videos of several policies.

use softvt_media::{
    axis::{Axis, Scale, Tick},
    drawing::Tone,
};

const SCALE: Scale = Scale::Logarithmic { from: 0.05, to: 50.0 };
pub(crate) const D_TICKS: [f64; 6] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0];

/// Place of D/τ on the axis, 0 to 1 within its ends.
pub(crate) fn d_share(d_over_tau: f64) -> f64 {
    SCALE.share(d_over_tau)
}

/// The axis for a chart in a video.
pub(crate) fn d_axis() -> Axis {
    let tick = |value: f64| match value {
        1.0 => Tick { value, label: "τ".to_owned(), tone: Tone::Harm },
        _ => Tick { value, label: value.to_string(), tone: Tone::Faint },
    };
    Axis { label: String::new(), scale: SCALE, ticks: D_TICKS.map(tick).to_vec(), has_grid: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_factors_are_equal_steps_from_end_to_end() {
        assert!(d_share(0.05).abs() < 1e-12 && (d_share(50.0) - 1.0).abs() < 1e-12);
        assert!((d_share(10.0) - d_share(1.0) - (d_share(1.0) - d_share(0.1))).abs() < 1e-12);
        assert!(d_share(0.0) < 0.0, "below the axis, and finite");
    }
}
