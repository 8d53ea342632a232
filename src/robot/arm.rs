//! Setpoint of the arm's drives between the commands of inverse kinematics.

use super::ik::ArmAngles;

/// Setpoint of the arm drives, which moves along a line to the commanded joint positions within one control step.
///
/// A setpoint that jumps once per control step would shake the hand: the drives reach the velocity of the jump within a
/// millisecond, so that the acceleration would be that velocity over the *physics* step, whatever its length. The line
/// has no target velocity either: the drives would follow its kinks as fast.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmSetpoint {
    target: ArmAngles,
    goal: ArmAngles,
    control_dt: f64,
    remaining: f64,
}

impl ArmSetpoint {
    /// A setpoint at rest at `q` (rad), for control steps of `control_dt` (s).
    pub fn new(q: ArmAngles, control_dt: f64) -> Self {
        Self { target: q, goal: q, control_dt, remaining: 0.0 }
    }

    /// Sets where the setpoint is to be at the end of the control step that begins, rad.
    pub fn command(&mut self, goal: ArmAngles) {
        (self.goal, self.remaining) = (goal, self.control_dt);
    }

    /// Moves the setpoint for `dt` (s) and returns the target of each drive, rad.
    pub fn advance(&mut self, dt: f64) -> ArmAngles {
        /// Share of a physics step by which the rounding of a sum of steps stays below.
        const ROUNDING: f64 = 1e-6;
        if self.remaining <= dt * (1.0 + ROUNDING) {
            (self.target, self.remaining) = (self.goal, 0.0);
        } else {
            let share = dt / self.remaining;
            self.target = std::array::from_fn(|i| self.target[i] + share * (self.goal[i] - self.target[i]));
            self.remaining -= dt;
        }
        self.target
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_setpoint_moves_along_a_line_and_ends_at_its_goal_whatever_the_physics_step() {
        for steps in [1, 2, 3, 6, 12, 24] {
            let mut arm = ArmSetpoint::new([0.0; 7], 0.05);
            for goal in [0.3, -0.1] {
                let start = arm.target[0];
                arm.command([goal; 7]);
                for step in 1..=steps {
                    let at = arm.advance(0.05 / f64::from(steps));
                    let line = start + (goal - start) * f64::from(step) / f64::from(steps);
                    assert!(at.iter().all(|q| (q - line).abs() < 1e-12), "{steps}: {at:?}, not {line}");
                }
                assert_eq!(arm.advance(0.05), [goal; 7], "no further without a command");
            }
        }
    }
}
