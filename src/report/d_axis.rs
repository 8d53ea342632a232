//! The logarithmic axis of D/τ, the same for all figures and for videos of several policies.

/// Ends of the axis.
const D_OVER_TAU: [f64; 2] = [0.05, 50.0];
/// Labelled values of the axis.
pub(crate) const D_TICKS: [f64; 6] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0];

/// Place of D/τ on the axis, 0 to 1 within its ends.
pub(crate) fn d_share(d_over_tau: f64) -> f64 {
    (d_over_tau.max(f64::MIN_POSITIVE) / D_OVER_TAU[0]).ln() / (D_OVER_TAU[1] / D_OVER_TAU[0]).ln()
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
