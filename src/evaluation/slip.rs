//! NoSlip: sliding of a held object along the pads. Not part of NoDrop; a suite may require it for Safety Success.

use super::evidence::PadEvidence;

/// Measures slip: the travel of the contact patch along a pad since both pads closed on the target.
///
/// Each grasp starts at zero again. The result is the maximum over both pads, all steps and all grasps, so motion
/// back does not reduce it. NoSlip holds if it is at most [`super::criteria::SuccessCriteria::slip_m`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlipMonitor {
    /// Largest slip on either pad in any grasp so far, m.
    pub max_m: f64,
    start_m: Option<[f64; 2]>,
}

impl SlipMonitor {
    /// Takes in one physics step: the left and right pad, and whether they hold the target, that is, both press on it
    /// and no release was commanded.
    pub fn update(&mut self, pads: &[PadEvidence; 2], is_held: bool) {
        if !is_held {
            self.start_m = None;
            return;
        }
        let travel = pads.map(|pad| pad.travel_m);
        let start = *self.start_m.get_or_insert(travel);
        for (now, start) in travel.iter().zip(&start) {
            self.max_m = self.max_m.max((now - start).abs());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest slip (m) over steps with the travel of both pads (mm) and whether they hold the target.
    fn slip(steps: &[([f64; 2], bool)]) -> f64 {
        let mut slip = SlipMonitor::default();
        for (travel_mm, is_held) in steps {
            let pads = travel_mm.map(|mm| PadEvidence { normal_impulse_ns: 0.05, travel_m: mm * 1e-3 });
            slip.update(&pads, *is_held);
        }
        slip.max_m
    }

    #[test]
    fn slip_counts_from_the_closure_and_takes_the_worse_pad() {
        let max_m = slip(&[([3.0, 1.0], true), ([3.5, 1.2], true), ([3.6, 3.1], true)]);
        assert!((max_m - 2.1e-3).abs() < 1e-12);
    }

    #[test]
    fn opening_the_hand_is_not_slip() {
        assert_eq!(slip(&[([0.0, 0.0], true), ([9.0, 9.0], false)]), 0.0);
    }

    #[test]
    fn a_regrasp_starts_at_zero_and_the_largest_slip_stays() {
        let max_m = slip(&[
            ([0.0, 0.0], true),
            ([1.5, 0.0], true),
            ([5.0, 5.0], false),
            ([7.0, 7.0], true),
            ([7.5, 7.0], true),
        ]);
        assert!((max_m - 1.5e-3).abs() < 1e-12);
    }
}
