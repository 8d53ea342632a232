//! The gripper: from a policy's closure to finger targets.
//!
//! Three separate quantities: *closure* is commanded (0 open to 1 closed), *width* is measured (m between the gel
//! apexes), *force* results from the contact solve.

use super::spec::GripperSpec;

/// Largest width between the gel apexes, m.
pub const MAX_WIDTH: f64 = 0.08;

/// Target width (m) of a closure in 0..=1.
pub fn target_width(closure: f64) -> f64 {
    MAX_WIDTH * (1.0 - closure)
}

/// Closure in 0..=1 whose target width is `width` (m), clamped; the inverse of [`target_width`].
fn closure_of_width(width: f64) -> f64 {
    (1.0 - width / MAX_WIDTH).clamp(0.0, 1.0)
}

/// Measured width (m between the gel apexes) at the joint coordinates (m) of the left and right finger.
pub fn width(fingers: [f64; 2]) -> f64 {
    fingers[0] + fingers[1]
}

/// Setpoint of the finger drives, which moves towards the commanded closure at the finger speed.
///
/// Both fingers receive the same setpoint: a light object off centre is pushed to the middle, and a fixed one is held
/// by unequal drive forces.
#[derive(Clone, Debug, PartialEq)]
pub struct GripperSetpoint {
    speed: f64,
    goal: f64,
    target: f64,
}

impl GripperSetpoint {
    /// A setpoint at rest at `width` (m).
    pub fn new(spec: &GripperSpec, width: f64) -> Self {
        let target = width.clamp(0.0, MAX_WIDTH) / 2.0;
        Self { speed: spec.speed, goal: target, target }
    }

    /// Sets the commanded closure, 0 (open) ..= 1 (closed); valid until the next call.
    pub fn command(&mut self, closure: f64) {
        self.goal = target_width(closure.clamp(0.0, 1.0)) / 2.0;
    }

    /// Moves the setpoint for `dt` (s), at most at the finger speed.
    pub fn advance(&mut self, dt: f64) {
        let step = self.speed * dt;
        self.target += (self.goal - self.target).clamp(-step, step);
    }

    /// Target joint coordinate of each finger, m.
    pub fn finger_target(&self) -> f64 {
        self.target
    }

    /// Last commanded closure, 0..=1.
    pub fn closure(&self) -> f64 {
        closure_of_width(2.0 * self.goal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closure_and_target_width_are_inverse() {
        for (closure, width) in [(0.0, 0.08), (0.25, 0.06), (1.0, 0.0)] {
            assert!((target_width(closure) - width).abs() < 1e-15);
            assert!((closure_of_width(width) - closure).abs() < 1e-15);
        }
    }

    #[test]
    fn the_setpoint_moves_at_the_finger_speed_and_stops_at_its_goal() {
        let mut gripper = GripperSetpoint::new(&GripperSpec::default(), MAX_WIDTH);
        gripper.command(0.5);
        let dt = 1.0 / 60.0;
        let mut path = Vec::new();
        for _ in 0..10 {
            gripper.advance(dt);
            path.push(gripper.finger_target());
        }
        assert!((path[0] - (0.04 - 0.2 * dt)).abs() < 1e-15);
        assert!(path.windows(2).all(|pair| pair[0] - pair[1] <= 0.2 * dt + 1e-15));
        assert_eq!(path[9], 0.02);
        assert!((gripper.closure() - 0.5).abs() < 1e-15);
    }
}
