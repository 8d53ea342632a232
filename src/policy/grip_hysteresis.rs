//! Grip codes whose closure depends on earlier answers: a gripper that is open or closed with hysteresis, and one that
//! holds a width.

use serde::{Deserialize, Serialize};

/// Closure above which an answer closes an open gripper: a target width below 72 mm.
const CLOSE_ABOVE: f64 = 0.1;
/// Closure below which an answer opens a closed gripper: a target width above 76 mm.
const OPEN_BELOW: f64 = 0.05;
/// Control steps after closing in which the width follows the answers: 0.5 s. A policy that learned two widths passes
/// through those in between.
const FOLLOW_STEPS: u32 = 10;

/// Hysteresis of a binary gripper, as SoftVTBench's release v0.2 decodes continuous answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GripHysteresis {
    /// Value from which on, towards that of the closed gripper, an answer closes.
    pub close: f64,
    /// Value from which on, towards that of the open gripper, an answer opens.
    pub open: f64,
    /// Control steps for which a change is kept whatever is answered.
    pub hold_steps: u32,
}

/// State of a gripper that is open or closed, with hysteresis: the decoder of SoftVTBench's release v0.2 for continuous
/// answers. A change is kept for some control steps, whatever is answered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GripSwitch {
    is_closed: bool,
    /// Control steps for which the state is still kept.
    held_steps: u32,
}

impl GripSwitch {
    /// Commanded closure, 0 or 1, after the answer of the next control step: true closes, false opens, `None` changes
    /// nothing.
    pub fn closure(&mut self, closes: Option<bool>, hold_steps: u32) -> f64 {
        if self.held_steps > 0 {
            self.held_steps -= 1;
        } else if let Some(is_closed) = closes.filter(|closes| *closes != self.is_closed) {
            *self = Self { is_closed, held_steps: hold_steps.saturating_sub(1) };
        }
        f64::from(u8::from(self.is_closed))
    }
}

/// Memory of the grip code two-width: a hand that is either open, or at the width that the policy gave when it closed.
///
/// The width follows the answers of the first 0.5 s after closing; the last of them is held until an answer opens the
/// gripper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WidthLatch {
    held: Option<HeldClosure>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct HeldClosure {
    closure: f64,
    /// Control steps since closing.
    steps: u32,
}

impl WidthLatch {
    /// Commanded closure after the answer of the next control step.
    pub fn closure(&mut self, answer: f64) -> f64 {
        self.held = match self.held {
            None if answer > CLOSE_ABOVE => Some(HeldClosure { closure: answer, steps: 1 }),
            None => None,
            Some(_) if answer < OPEN_BELOW => None,
            Some(HeldClosure { closure, steps }) => {
                let closure = if steps < FOLLOW_STEPS { answer } else { closure };
                Some(HeldClosure { closure, steps: steps.saturating_add(1) })
            }
        };
        self.held.map_or(0.0, |held| held.closure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_kept_for_some_steps_and_then_until_an_answer_on_the_other_side() {
        let mut switch = GripSwitch::default();
        let mut run = |answers: &[Option<bool>]| -> Vec<f64> {
            answers.iter().map(|closes| switch.closure(*closes, 3)).collect()
        };
        assert_eq!(run(&[None, Some(false)]), [0.0, 0.0]);
        assert_eq!(run(&[Some(true), Some(false), Some(false)]), [1.0; 3], "three steps at least");
        assert_eq!(run(&[None, None]), [1.0; 2], "between both limits nothing changes");
        assert_eq!(run(&[Some(false), Some(true), None, None]), [0.0; 4]);
    }

    #[test]
    fn the_width_is_held_from_half_a_second_after_closing_until_an_answer_opens() {
        let mut latch = WidthLatch::default();
        let run = |latch: &mut WidthLatch, answers: &[f64]| -> Vec<f64> {
            answers.iter().map(|answer| latch.closure(*answer)).collect()
        };
        assert_eq!(run(&mut latch, &[0.0, 0.02, 0.1]), [0.0; 3], "noise about zero keeps the gripper open");
        // A blend of both widths, then the width of the object.
        assert_eq!(run(&mut latch, &[0.2, 0.3]), [0.2, 0.3]);
        assert_eq!(run(&mut latch, &[0.42; 8]), [0.42; 8]);
        assert_eq!(run(&mut latch, &[0.9, 0.06, 0.5]), [0.42; 3], "held, whatever is answered while closed");
        assert_eq!(run(&mut latch, &[0.04, 0.08, 0.0]), [0.0; 3], "opened, and not closed by a small answer");
        assert_eq!(run(&mut latch, &[0.55]), [0.55], "the next object has a width of its own");
    }
}
