//! A gripper that is open or closed, with hysteresis: the decoder of SoftVTBench's release v0.2 for continuous answers.

/// State of a gripper with hysteresis. A change is kept for some control steps, whatever is answered.
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
}
