//! The control rate.

use crate::text::format_number;

/// Control period, s: policies act, and results are recorded, at 20 Hz.
pub const CONTROL_DT: f64 = 0.05;

/// Number of physics steps of `dt` seconds per control step, 3 at 60 Hz. `dt` must divide [`CONTROL_DT`].
pub fn steps_per_control(dt: f64) -> u32 {
    (CONTROL_DT / dt).round().max(1.0) as u32
}

/// Error of a physics step that does not divide the control period.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "physics.dt: control runs at 20 Hz, so dt must divide {CONTROL_DT} s; got {}, near are {below:.6} and {above:.6}",
    format_number(*dt)
)]
pub struct TimeStepError {
    dt: f64,
    below: f64,
    above: f64,
}

/// Checks that `dt` divides [`CONTROL_DT`].
///
/// # Errors
/// It does not. The message proposes the nearest values.
pub fn check_dt(dt: f64) -> Result<(), TimeStepError> {
    let steps = f64::from(steps_per_control(dt));
    if (steps * dt - CONTROL_DT).abs() <= 1e-9 {
        return Ok(());
    }
    let (below, above) =
        (CONTROL_DT / (CONTROL_DT / dt).ceil(), CONTROL_DT / (CONTROL_DT / dt).floor().max(1.0));
    Err(TimeStepError { dt, below, above })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_control_rate_does_not_depend_on_the_physics_step() {
        for (dt, steps) in [(1.0 / 60.0, 3), (1.0 / 120.0, 6), (1.0 / 240.0, 12), (0.05, 1), (1e-4, 500)] {
            assert_eq!(steps_per_control(dt), steps);
            assert!(check_dt(dt).is_ok());
        }
        assert!(
            check_dt(1.0 / 50.0)
                .is_err_and(|e| e.to_string().contains("0.016667") && e.to_string().contains("0.025"))
        );
    }
}
