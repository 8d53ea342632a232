//! The logarithmic axis of D/τ, the same for all figures, for videos of several policies and for the page of
//! `softvt watch`.

use crate::{
    axis::{Axis, Scale, Tick},
    drawing::Tone,
};

/// D/τ at both ends.
pub const D_ENDS: [f64; 2] = [0.05, 50.0];
const SCALE: Scale = Scale::Logarithmic { from: D_ENDS[0], to: D_ENDS[1] };
pub const D_TICKS: [f64; 6] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0];

/// Place of D/τ on the axis, 0 to 1 within its ends.
pub fn d_share(d_over_tau: f64) -> f64 {
    SCALE.share(d_over_tau)
}

/// The axis for a chart in a video.
pub fn d_axis() -> Axis {
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
