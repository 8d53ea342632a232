//! NoSlip: sliding of a carried object along the pads. Reported next to NoDrop; a suite may make Safety Success depend on it.

use super::evidence::PadEvidence;

/// Measures slip: the travel of the contact patch along a pad since the pads alone carried the target. Pads that slide along an
/// object on its support, as those of a hand that feels for its weight, do not slip.
///
/// Each time that the object leaves its support starts at zero again. The result is the maximum over both pads, all steps and all
/// such times, so motion back does not reduce it. NoSlip holds if it is at most
/// [`super::criteria::SuccessCriteria::slip_m`].
///
/// A hand that opens lets the object slide before the pads leave it. That slip counts only if the hand stops opening, so that
/// the release itself is not slip, and loosening a grip until it slips is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlipMonitor {
    /// Largest slip on either pad so far, m.
    pub max_m: f64,
    /// Largest slip since the hand began to open, m.
    opening_m: f64,
    start_m: Option<[f64; 2]>,
}

impl SlipMonitor {
    /// Takes in one physics step: the left and right pad, whether they alone carry the target, that is, both press on it, nothing
    /// supports it and no release was commanded, and whether the hand is being opened.
    pub fn update(&mut self, pads: &[PadEvidence; 2], is_carried: bool, is_opening: bool) {
        if !is_carried {
            (self.start_m, self.opening_m) = (None, 0.0);
            return;
        }
        let travel = pads.map(|pad| pad.travel_m);
        let start = *self.start_m.get_or_insert(travel);
        for (now, start) in travel.iter().zip(&start) {
            self.opening_m = self.opening_m.max((now - start).abs());
        }
        if !is_opening {
            self.max_m = self.max_m.max(std::mem::take(&mut self.opening_m));
        }
    }
}

/// Detects that the gripper is being opened: its commanded width has grown within the last control step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OpeningMonitor {
    commanded_width_m: Option<f64>,
    /// Physics steps since the width grew.
    steps: Option<u32>,
}

impl OpeningMonitor {
    /// Takes in the commanded width (m) of one physics step. Commands change every `steps_per_control` steps.
    pub fn update(&mut self, commanded_width_m: f64, steps_per_control: u32) -> bool {
        let before = self.commanded_width_m.replace(commanded_width_m).unwrap_or(commanded_width_m);
        self.steps = match (commanded_width_m > before, commanded_width_m < before) {
            (true, _) => Some(0),
            (_, true) => None,
            _ => self.steps.map(|steps| steps + 1),
        };
        self.steps.is_some_and(|steps| steps < steps_per_control)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One step: travel of both pads (mm), whether they carry the target, and whether the hand opens.
    type Step = ([f64; 2], bool, bool);

    /// Largest slip (mm) over steps.
    fn slip_mm(steps: &[Step]) -> f64 {
        let mut slip = SlipMonitor::default();
        for (travel_mm, is_carried, is_opening) in steps {
            let pads = travel_mm.map(|mm| PadEvidence { normal_force_n: 3.0, travel_m: mm * 1e-3 });
            slip.update(&pads, *is_carried, *is_opening);
        }
        1e3 * slip.max_m
    }

    const CARRIED: bool = true;

    #[test]
    fn slip_counts_from_the_support_and_takes_the_worse_pad() {
        let steps =
            [([3.0, 1.0], CARRIED, false), ([3.5, 1.2], CARRIED, false), ([3.6, 3.1], CARRIED, false)];
        assert!((slip_mm(&steps) - 2.1).abs() < 1e-9);
    }

    #[test]
    fn opening_the_hand_until_it_releases_is_not_slip() {
        assert_eq!(slip_mm(&[([0.0, 0.0], CARRIED, false), ([9.0, 9.0], false, false)]), 0.0);
        let slid = ([4.0, 4.0], CARRIED, true);
        assert_eq!(slip_mm(&[([0.0, 0.0], CARRIED, false), slid, ([9.0, 9.0], false, true)]), 0.0);
    }

    #[test]
    fn loosening_a_grip_until_it_slips_is_slip() {
        let slid = ([4.0, 4.0], CARRIED, true);
        assert!(
            (slip_mm(&[([0.0, 0.0], CARRIED, false), slid, ([4.0, 4.0], CARRIED, false)]) - 4.0).abs() < 1e-9
        );
    }

    #[test]
    fn another_lift_starts_at_zero_and_the_largest_slip_stays() {
        let carried = |mm| (mm, CARRIED, false);
        let steps = [
            carried([0.0, 0.0]),
            carried([1.5, 0.0]),
            ([5.0, 5.0], false, true),
            carried([7.0, 7.0]),
            carried([7.5, 7.0]),
        ];
        assert!((slip_mm(&steps) - 1.5).abs() < 1e-9);
    }

    #[test]
    fn a_hand_opens_from_the_growth_of_its_command_until_a_control_step_without() {
        let mut opening = OpeningMonitor::default();
        let widths = [20.0, 20.0, 21.0, 21.0, 21.0, 22.0, 22.0, 22.0, 22.0, 21.0, 21.0];
        let seen = widths.map(|width| opening.update(1e-3 * width, 3));
        assert_eq!(seen, [false, false, true, true, true, true, true, true, false, false, false]);
    }
}
