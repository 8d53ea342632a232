//! NoSlip: sliding of a carried object along the pads. Reported next to NoDrop; a suite may make Safety Success depend
//! on it.

use super::evidence::PadEvidence;

/// Measures slip: the distance that the contact patch slides along a pad while the pads alone carry the target. Pads
/// that slide along an object on its support, as those of a hand that feels for its weight, do not slip.
///
/// Distances add up over the episode, so that neither a motion back nor another grasp reduces them; the worse pad
/// counts. NoSlip holds if the sum is at most [`super::criteria::SuccessCriteria::slip_m`].
///
/// A hand that opens lets the object slide before the pads leave it. That sliding does not count if the pads leave it
/// within [`RELEASE_S`] of the begin of the opening.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlipMonitor {
    /// Distance slid along each pad, m.
    slid_m: [f64; 2],
    /// The same while the hand has been opening, m.
    opening_m: [f64; 2],
    /// Time for which it has been opening, s.
    opening_s: f64,
}

/// Longest duration of an opening whose sliding belongs to the release, s.
pub const RELEASE_S: f64 = 1.0;

/// One physics step as [`SlipMonitor`] reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipSample {
    /// Left and right pad.
    pub pads: [PadEvidence; 2],
    /// True if both pads touch the target and no release was commanded.
    pub is_held: bool,
    /// True if something else than the robot supports it.
    pub is_supported: bool,
    /// True if the hand is being opened.
    pub is_opening: bool,
}

impl SlipMonitor {
    /// Takes in one physics step of `dt_s`.
    pub fn update(&mut self, dt_s: f64, sample: &SlipSample) {
        if !sample.is_held {
            (self.opening_m, self.opening_s) = ([0.0; 2], 0.0);
            return;
        }
        self.opening_s = if sample.is_opening { self.opening_s + dt_s } else { 0.0 };
        for ((pad, slid), opening) in sample.pads.iter().zip(&mut self.slid_m).zip(&mut self.opening_m) {
            if !sample.is_supported {
                *opening += pad.slip_speed_m_s * dt_s;
            }
            if !sample.is_opening || self.opening_s > RELEASE_S {
                *slid += std::mem::take(opening);
            }
        }
    }

    /// Slip so far, m.
    pub fn slip_m(&self) -> f64 {
        self.slid_m[0].max(self.slid_m[1])
    }
}

/// Growth of the commanded width in a control step from which on the hand counts as opening, m.
const LEAST_OPENING_M: f64 = 1e-4;

/// Detects that the gripper is being opened: its commanded width has grown by `LEAST_OPENING_M` or more
/// within the last control step.
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
        self.steps = match commanded_width_m - before {
            growth if growth >= LEAST_OPENING_M => Some(0),
            growth if growth < 0.0 => None,
            _ => self.steps.map(|steps| steps + 1),
        };
        self.steps.is_some_and(|steps| steps < steps_per_control)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 60.0;

    /// Some physics steps in the same state: their number, the speeds of both pads (mm/s), whether the pads hold the
    /// target, whether it is supported, and whether the hand opens.
    #[derive(Clone, Copy)]
    struct Steps(u32, [f64; 2], bool, bool, bool);

    /// Slip after some steps, mm.
    fn slip_mm(all: &[Steps]) -> f64 {
        let mut slip = SlipMonitor::default();
        for &Steps(count, speeds_mm_s, is_held, is_supported, is_opening) in all {
            let pads =
                speeds_mm_s.map(|speed| PadEvidence { normal_force_n: 3.0, slip_speed_m_s: 1e-3 * speed });
            let sample = SlipSample { pads, is_held, is_supported, is_opening };
            (0..count).for_each(|_| slip.update(DT, &sample));
        }
        1e3 * slip.slip_m()
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9
    }

    const CARRIED: Steps = Steps(60, [1.0, 2.0], true, false, false);

    #[test]
    fn sliding_adds_up_while_the_pads_alone_carry_and_the_worse_pad_counts() {
        let supported = Steps(60, [9.0; 2], true, true, false);
        assert!(near(slip_mm(&[supported, CARRIED]), 2.0));
        // Put down, or touched by a wall, and lifted again.
        assert!(near(slip_mm(&[CARRIED, supported, CARRIED]), 4.0));
        let let_go = Steps(6, [0.0; 2], false, true, false);
        assert!(near(slip_mm(&[CARRIED, let_go, CARRIED]), 4.0));
    }

    #[test]
    fn opening_the_hand_until_it_releases_is_not_slip() {
        let slides = Steps(30, [20.0; 2], true, false, true);
        let released = Steps(6, [0.0; 2], false, false, true);
        assert_eq!(slip_mm(&[slides, released]), 0.0);
        let settles = Steps(6, [20.0; 2], true, true, true);
        assert_eq!(slip_mm(&[slides, settles, released]), 0.0);
    }

    #[test]
    fn opening_that_does_not_release_or_takes_long_is_slip() {
        let slides = Steps(30, [4.0; 2], true, false, true);
        assert!(near(slip_mm(&[slides, Steps(1, [0.0; 2], true, false, false)]), 2.0));
        assert!(near(slip_mm(&[slides, Steps(1, [0.0; 2], true, true, false)]), 2.0), "put down and held");
        let released = Steps(6, [0.0; 2], false, false, true);
        assert!(near(slip_mm(&[slides, slides, slides, released]), 6.0), "1.5 s");
    }

    #[test]
    fn a_hand_opens_from_the_growth_of_its_command_until_a_control_step_without() {
        let mut opening = OpeningMonitor::default();
        let widths = [20.0, 20.0, 21.0, 21.0, 21.0, 22.0, 22.0, 22.0, 22.0, 21.0, 21.0];
        let seen = widths.map(|width| opening.update(1e-3 * width, 3));
        assert_eq!(seen, [false, false, true, true, true, true, true, true, false, false, false]);
        let mut creeping = OpeningMonitor::default();
        assert!((0..100).all(|step| !creeping.update(0.02 + 1e-9 * f64::from(step), 1)));
    }
}
