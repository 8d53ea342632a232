//! Hysteresis of a gripper that is open or closed: the grip code two-width, and binary codes with two limits.

use serde::{Deserialize, Serialize};

/// Closure above which an answer in the code two-width closes an open gripper: a target width below 72 mm.
const CLOSE_ABOVE: f64 = 0.1;
/// Closure below which it opens a closed gripper: a target width above 76 mm.
const OPEN_BELOW: f64 = 0.05;
/// Control steps after closing in which the width follows the answers: 0.5 s. A policy that learned two widths passes
/// through those in between.
const FOLLOW_STEPS: u32 = 10;

/// Hysteresis of a binary gripper, as SoftVTBench's release v0.2 decodes continuous answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GripHysteresis {
    /// Value from which on, towards the closed gripper's value, an answer closes.
    pub close: f64,
    /// Value from which on, towards the open gripper's value, an answer opens.
    pub open: f64,
    /// Control steps for which a change is kept whatever is answered.
    pub hold_steps: u32,
}

/// State of a gripper with hysteresis: open, or closed at a closure that is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripLatch {
    held: Option<f64>,
    /// Control steps since the last change.
    steps: u32,
}

impl Default for GripLatch {
    fn default() -> Self {
        Self { held: None, steps: u32::MAX }
    }
}

impl GripLatch {
    /// Commanded closure, 0 or 1, after the answer of the next control step: true closes, false opens, `None` changes
    /// nothing. A change is kept for `hold_steps`.
    pub fn switched(&mut self, closes: Option<bool>, hold_steps: u32) -> f64 {
        self.advance(closes, 1.0, hold_steps, 0)
    }

    /// Commanded closure after the answer of the next control step in the code two-width. It follows the answers of the
    /// first 0.5 s after closing; the last of them is held until an answer opens the gripper.
    pub fn two_width(&mut self, answer: f64) -> f64 {
        let closes = match answer {
            _ if answer > CLOSE_ABOVE => Some(true),
            _ if answer < OPEN_BELOW => Some(false),
            _ => None,
        };
        self.advance(closes, answer, 0, FOLLOW_STEPS)
    }

    fn advance(&mut self, closes: Option<bool>, closure: f64, hold_steps: u32, follow_steps: u32) -> f64 {
        self.steps = self.steps.saturating_add(1);
        match closes {
            Some(closes) if closes != self.held.is_some() && self.steps >= hold_steps => {
                *self = Self { held: closes.then_some(closure), steps: 0 };
            }
            _ if self.held.is_some() && self.steps < follow_steps => self.held = Some(closure),
            _ => {}
        }
        self.held.unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_kept_for_some_steps_and_then_until_an_answer_on_the_other_side() {
        let mut latch = GripLatch::default();
        let mut run = |answers: &[Option<bool>]| -> Vec<f64> {
            answers.iter().map(|closes| latch.switched(*closes, 3)).collect()
        };
        assert_eq!(run(&[None, Some(false)]), [0.0, 0.0]);
        assert_eq!(run(&[Some(true), Some(false), Some(false)]), [1.0; 3], "three steps at least");
        assert_eq!(run(&[None, None]), [1.0; 2], "between both limits nothing changes");
        assert_eq!(run(&[Some(false), Some(true), None, None]), [0.0; 4]);
    }

    #[test]
    fn the_width_is_held_from_half_a_second_after_closing_until_an_answer_opens() {
        let mut latch = GripLatch::default();
        let mut run =
            |answers: &[f64]| -> Vec<f64> { answers.iter().map(|answer| latch.two_width(*answer)).collect() };
        assert_eq!(run(&[0.0, 0.02, 0.1]), [0.0; 3], "noise about zero keeps the gripper open");
        // A blend of both widths, then the width of the object.
        assert_eq!(run(&[0.2, 0.3]), [0.2, 0.3]);
        assert_eq!(run(&[0.42; 8]), [0.42; 8]);
        assert_eq!(run(&[0.9, 0.06, 0.5]), [0.42; 3], "held, whatever is answered while closed");
        assert_eq!(run(&[0.04, 0.08, 0.0]), [0.0; 3], "opened, and not closed by a small answer");
        assert_eq!(run(&[0.55]), [0.55], "the next object has a width of its own");
    }
}
