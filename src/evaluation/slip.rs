//! NoSlip: sliding of a held object along the pads. Reported next to NoDrop, not part of it.

use super::evidence::PadEvidence;

/// One physics step as [`SlipMonitor`] reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipSample {
    /// Left and right pad.
    pub pads: [PadEvidence; 2],
    /// True if both pads press on the target and no release was commanded.
    pub is_held: bool,
}

/// Measures slip: the travel of the contact patch along a pad since both pads closed on the target.
///
/// Each grasp starts at zero again. The result is the maximum over both pads, all steps and all grasps, so motion
/// back does not reduce it. NoSlip holds if it is at most [`super::criteria::SuccessCriteria::slip_m`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlipMonitor {
    start_m: Option<[f64; 2]>,
    max_m: f64,
}

impl SlipMonitor {
    /// Takes in one physics step.
    pub fn update(&mut self, sample: &SlipSample) {
        if !sample.is_held {
            self.start_m = None;
            return;
        }
        let travel = sample.pads.map(|pad| pad.travel_m);
        let start = *self.start_m.get_or_insert(travel);
        for (now, start) in travel.iter().zip(&start) {
            self.max_m = self.max_m.max((now - start).abs());
        }
    }

    /// Largest slip on either pad in any grasp so far, m.
    pub fn max_m(&self) -> f64 {
        self.max_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(travel_mm: [f64; 2], is_held: bool) -> SlipSample {
        let pads = travel_mm.map(|mm| PadEvidence { normal_impulse_ns: 0.05, travel_m: mm * 1e-3 });
        SlipSample { pads, is_held }
    }

    #[test]
    fn slip_counts_from_the_closure_and_takes_the_worse_pad() {
        let mut slip = SlipMonitor::default();
        [sample([3.0, 1.0], true), sample([3.5, 1.2], true), sample([3.6, 3.1], true)]
            .iter()
            .for_each(|s| slip.update(s));
        assert!((slip.max_m() - 2.1e-3).abs() < 1e-12);
    }

    #[test]
    fn opening_the_hand_is_not_slip() {
        let mut slip = SlipMonitor::default();
        [sample([0.0, 0.0], true), sample([9.0, 9.0], false)].iter().for_each(|s| slip.update(s));
        assert_eq!(slip.max_m(), 0.0);
    }

    #[test]
    fn a_regrasp_starts_at_zero_and_the_largest_slip_stays() {
        let mut slip = SlipMonitor::default();
        for s in [
            sample([0.0, 0.0], true),
            sample([1.5, 0.0], true),
            sample([5.0, 5.0], false),
            sample([7.0, 7.0], true),
            sample([7.5, 7.0], true),
        ] {
            slip.update(&s);
        }
        assert!((slip.max_m() - 1.5e-3).abs() < 1e-12);
    }
}
