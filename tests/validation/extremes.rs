//! Squeezes at the ends of the range.

use crate::support::{Outcome, Squeeze, run};

/// A soft cube squeezed by 78 %.
pub fn crushed() -> Outcome {
    run(&Squeeze { youngs_pa: 1e4, ..Squeeze::default() }.gap_mm(11.0))
}

/// A cube of 1 MPa.
pub fn stiff() -> Outcome {
    run(&Squeeze { youngs_pa: 1e6, ..Squeeze::default() }.gap_mm(48.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_squeeze_of_78_per_cent_is_computed_to_its_end() {
        let ours = crushed();
        assert!(ours.failure.is_none(), "{:?}", ours.failure);
        assert!(ours.d_peak_pct.is_finite() && ours.d_peak_pct > 5.0 && ours.d_peak_pct < 40.0, "{ours:?}");
    }

    #[test]
    fn no_element_inverts_down_to_a_gap_of_30_millimetres() {
        for gap in [42.0, 34.0, 30.0] {
            let ours = run(&Squeeze::default().gap_mm(gap));
            assert!(ours.failure.is_none() && ours.min_det_f > 0.0, "gap {gap}: {ours:?}");
        }
    }

    #[test]
    fn a_cube_of_one_megapascal_is_held_steadily() {
        let ours = stiff();
        assert!(ours.failure.is_none() && ours.holds, "{ours:?}");
        assert!(ours.ripple < 1e-3 && ours.creep_mm_per_s.abs() < 1e-3, "{ours:?}");
    }
}
