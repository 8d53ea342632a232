//! NoSlip: how far a held object slid along the pads. Reported beside NoDrop, not part of it.

use super::evidence::PadEvidence;

/// What [`SlipWatch`] reads of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// The two pads.
    pub pads: [PadEvidence; 2],
    /// Both press on the target and the hand has not been told to release.
    pub held: bool,
}

/// Measures slip since both pads closed on the target; a regrasp starts anew, the largest slip stays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlipWatch {
    start_m: Option<[f64; 2]>,
    largest_m: f64,
}

impl SlipWatch {
    /// Looks at one step.
    pub fn observe(&mut self, hold: &Hold) {
        if !hold.held {
            self.start_m = None;
            return;
        }
        let travel = hold.pads.map(|pad| pad.travel_m);
        let start = *self.start_m.get_or_insert(travel);
        for (now, start) in travel.iter().zip(&start) {
            self.largest_m = self.largest_m.max((now - start).abs());
        }
    }

    /// Largest slip on either pad in any grasp so far, m.
    pub fn largest_m(&self) -> f64 {
        self.largest_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hold(travel_mm: [f64; 2], held: bool) -> Hold {
        Hold { pads: travel_mm.map(|mm| PadEvidence { normal_impulse_ns: 0.05, travel_m: mm * 1e-3 }), held }
    }

    #[test]
    fn slip_counts_from_the_closure_and_takes_the_worse_pad() {
        let mut slip = SlipWatch::default();
        [hold([3.0, 1.0], true), hold([3.5, 1.2], true), hold([3.6, 3.1], true)]
            .iter()
            .for_each(|h| slip.observe(h));
        assert!((slip.largest_m() - 2.1e-3).abs() < 1e-12);
    }

    #[test]
    fn opening_the_hand_does_not_slip() {
        let mut slip = SlipWatch::default();
        [hold([0.0, 0.0], true), hold([9.0, 9.0], false)].iter().for_each(|h| slip.observe(h));
        assert_eq!(slip.largest_m(), 0.0);
    }

    #[test]
    fn a_regrasp_starts_anew_and_the_largest_stays() {
        let mut slip = SlipWatch::default();
        for h in [
            hold([0.0, 0.0], true),
            hold([1.5, 0.0], true),
            hold([5.0, 5.0], false),
            hold([7.0, 7.0], true),
            hold([7.5, 7.0], true),
        ] {
            slip.observe(&h);
        }
        assert!((slip.largest_m() - 1.5e-3).abs() < 1e-12);
    }
}
