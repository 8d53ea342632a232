//! The gripper: from a policy's closure or grip force to finger targets.
//!
//! Three separate quantities: *closure* is commanded (0 open to 1 closed), *width* is measured (m between the gel
//! apexes), *force* results from the contact solve. A *grip force* is commanded instead of a closure: the hand closes
//! until its drives exert that force.

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

/// Largest speed of each finger while it closes to a grip force, m/s. The drives pull with `kd` times it, 3 N, more
/// than the fingers press; the approach to smaller forces is slower.
const FORCE_SPEED: f64 = 0.03;
/// Time in which the setpoint makes up for a missing grip force, s. Shorter than the drives' own response
/// (`kd / kp`, 0.05 s) it would overshoot.
const FORCE_RESPONSE: f64 = 0.05;

/// Largest distance of the setpoint below 0 while a grip force is built up, relative to the joint coordinate of the
/// fingers: on an object of width w the drives reach `(1 + 3) kp w / 2`, 70 N from 17.5 mm on. Shut fingers stop at 0.
const FORCE_LEAD: f64 = 3.0;

/// Command of the gripper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GripTarget {
    /// A closure, 0 (open) ..= 1 (closed).
    Closure(f64),
    /// A grip force, N: the force of each pad on what is between them.
    Force(f64),
}

/// Measurements of the drives of both fingers in the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerState {
    /// Distance between the gel apexes, m.
    pub width: f64,
    /// Mean force with which the drives closed, N.
    pub closing_force: f64,
}

/// Setpoint of the finger drives, which moves towards the commanded closure at the finger speed, or closes until the
/// drives exert the commanded grip force.
///
/// Both fingers receive the same setpoint: a light object off centre is pushed to the middle, and a fixed one is held
/// by unequal drive forces.
#[derive(Clone, Debug, PartialEq)]
pub struct GripperSetpoint {
    speed: f64,
    kp: f64,
    goal: GripTarget,
    target: f64,
}

impl GripperSetpoint {
    /// A setpoint at rest at `width` (m).
    pub fn new(spec: &GripperSpec, width: f64) -> Self {
        let width = width.clamp(0.0, MAX_WIDTH);
        let goal = GripTarget::Closure(closure_of_width(width));
        Self { speed: spec.speed, kp: spec.kp, goal, target: width / 2.0 }
    }

    /// Sets the command, valid until the next call. A closure is clamped to 0..=1.
    pub fn command(&mut self, goal: GripTarget) {
        self.goal = match goal {
            GripTarget::Closure(closure) => GripTarget::Closure(closure.clamp(0.0, 1.0)),
            GripTarget::Force(force) => GripTarget::Force(force),
        };
    }

    /// Moves the setpoint for `dt` (s), at most at the finger speed.
    pub fn advance(&mut self, dt: f64, fingers: FingerState) {
        let step = match self.goal {
            GripTarget::Closure(closure) => {
                let most = self.speed * dt;
                (target_width(closure) / 2.0 - self.target).clamp(-most, most)
            }
            // At rest the force of an object of stiffness k changes by k kp / (k + kp) per displacement of the
            // setpoint, at most by kp: the error falls by a factor between 0 and 1 per response time.
            GripTarget::Force(force) => {
                let most = self.speed.min(FORCE_SPEED) * dt;
                let missing = (force - fingers.closing_force) / self.kp;
                -(missing * (dt / FORCE_RESPONSE).min(1.0)).clamp(-most, most)
            }
        };
        let lowest = -FORCE_LEAD * (fingers.width / 2.0).max(0.0);
        self.target = match self.goal {
            GripTarget::Closure(_) => self.target + step,
            GripTarget::Force(_) => (self.target + step).clamp(lowest, MAX_WIDTH / 2.0),
        };
    }

    /// Target joint coordinate of each finger, m. Below 0 while a grip force is built up on something thin.
    pub fn finger_target(&self) -> f64 {
        self.target
    }

    /// Last commanded closure, 0..=1; 1 for a grip force.
    pub fn closure(&self) -> f64 {
        match self.goal {
            GripTarget::Closure(closure) => closure,
            GripTarget::Force(_) => 1.0,
        }
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
        gripper.command(GripTarget::Closure(0.5));
        let dt = 1.0 / 60.0;
        let mut path = Vec::new();
        for _ in 0..10 {
            gripper.advance(dt, FingerState { width: MAX_WIDTH, closing_force: 0.0 });
            path.push(gripper.finger_target());
        }
        assert!((path[0] - (0.04 - 0.2 * dt)).abs() < 1e-15);
        assert!(path.windows(2).all(|pair| pair[0] - pair[1] <= 0.2 * dt + 1e-15));
        assert_eq!(path[9], 0.02);
        assert!((gripper.closure() - 0.5).abs() < 1e-15);
    }

    /// Fingers with the drive's law on a spring, by explicit integration of small steps.
    fn force_on_spring(stiffness: f64, force: f64, seconds: f64) -> Vec<f64> {
        let spec = GripperSpec::default();
        let mut gripper = GripperSetpoint::new(&spec, MAX_WIDTH);
        gripper.command(GripTarget::Force(force));
        let (dt, substeps, contact) = (1.0 / 60.0, 2000, 0.025);
        let (mut q, mut v, mut closing) = (0.04, 0.0, 0.0);
        let mut pressed = Vec::new();
        for _ in 0..(seconds / dt) as usize {
            gripper.advance(dt, FingerState { width: 2.0 * q, closing_force: closing });
            for _ in 0..substeps {
                let h = dt / f64::from(substeps);
                let drive =
                    (spec.kp * (gripper.finger_target() - q) - spec.kd * v).clamp(-spec.effort, spec.effort);
                let push = stiffness * f64::max(contact - q, 0.0);
                v += h * (drive + push) / spec.finger_mass;
                q += h * v;
                closing = -drive;
            }
            pressed.push(stiffness * f64::max(contact - q, 0.0));
        }
        pressed
    }

    #[test]
    fn a_grip_force_is_reached_on_soft_and_stiff_objects_without_much_overshoot() {
        for stiffness in [200.0, 1000.0, 5000.0, 100_000.0] {
            // Harder than the softest one can press at any width.
            for force in [1.0, 4.0, 20.0].into_iter().filter(|force| *force < 0.02 * stiffness) {
                let pressed = force_on_spring(stiffness, force, 8.0);
                let (last, most) = (pressed[pressed.len() - 1], pressed.iter().copied().fold(0.0, f64::max));
                assert!((last / force - 1.0).abs() < 0.01, "k {stiffness}, {force} N: {last} N");
                assert!(most < 1.1 * force + 0.1, "k {stiffness}, {force} N: up to {most} N");
            }
        }
    }

    #[test]
    fn shut_fingers_stop_whatever_force_is_commanded() {
        let spec = GripperSpec::default();
        let mut gripper = GripperSetpoint::new(&spec, MAX_WIDTH);
        gripper.command(GripTarget::Force(70.0));
        // The drive's law without a mass, by implicit steps as in the solver.
        let (dt, mut q, mut closing) = (1.0 / 60.0, 0.04, 0.0);
        for _ in 0..600 {
            gripper.advance(dt, FingerState { width: 2.0 * q, closing_force: closing });
            let target = gripper.finger_target();
            let next = (spec.kd * q + dt * spec.kp * target) / (spec.kd + dt * spec.kp);
            closing = -(spec.kp * (target - next) - spec.kd * (next - q) / dt);
            q = next;
            assert!(q > -1e-9, "{q}");
        }
        assert!(q < 1e-3, "{q}");
    }
}
