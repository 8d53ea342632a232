//! Parameters of the robot that experiments may change, with defaults and ranges.

use serde::{Deserialize, Serialize};

use softvt_common::{
    range::{Range, RangeError},
    settings::SettingField,
};

softvt_common::settings! {
    /// Parameters of arm, gripper, pads and inverse kinematics; the settings `robot.*` of an experiment.
    ///
    /// Missing fields take their defaults, unknown fields are errors. [`Self::validate`] checks the ranges.
    pub struct RobotSpec {
        /// Joint drives of the arm.
        arm: ArmSpec;
        /// Finger drives.
        gripper: GripperSpec;
        /// Contact of the gel pads.
        pads: PadSpec;
        /// Inverse kinematics.
        ik: IkSpec;
        /// Errors of the measured gripper width.
        width_sensor: WidthSensorSpec;
        /// Delay between a command and the robot's response, control steps of 0.05 s.
        latency: u32 = 0, "control steps", Range::closed(0.0, MAX_LATENCY);
        /// Random offset of the executed poses from the commanded ones.
        disturbance: DisturbanceSpec;
    }
}

/// Longest latency, control steps: 5 s.
const MAX_LATENCY: f64 = 100.0;

impl RobotSpec {
    /// Checks that every number is finite and in its range, and that the pads do not stick less than they slide.
    ///
    /// # Errors
    /// The first field out of its range.
    pub fn validate(&self) -> Result<(), RangeError> {
        self.check("robot")?;
        let PadSpec { static_mu, dynamic_mu, .. } = self.pads;
        Range::closed(0.0, static_mu).check("robot.pads.dynamic_mu", dynamic_mu, "")
    }
}

softvt_common::settings! {
    /// Joint drives of the arm: `τ = kp (q_target − q) − kd q̇`, limited to the torques of the real arm (the effort
    /// limits of [`panda::tree`](super::panda::tree)), in addition to exact gravity compensation. The same gains
    /// apply to all joints.
    pub struct ArmSpec {
        /// Stiffness.
        kp: f64 = 8000.0, "N m/rad", Range::above(0.0, 1e6);
        /// Damping.
        kd: f64 = 800.0, "N m s/rad", Range::above(0.0, 1e5);
    }
}

softvt_common::settings! {
    /// Drive of each finger: `f = kp (q_target − q) − kd q̇`, limited to `effort`. The opening range is fixed
    /// by the hardware ([`MAX_WIDTH`](super::gripper::MAX_WIDTH)).
    pub struct GripperSpec {
        /// Stiffness.
        kp: f64 = 2000.0, "N/m", Range::above(0.0, 1e6);
        /// Damping.
        kd: f64 = 100.0, "N s/m", Range::above(0.0, 1e5);
        /// Largest force per finger. The real hand holds 70 N continuously (Franka Emika, Hand data sheet); the paper's
        /// simulator has 200 N.
        effort: f64 = 70.0, "N", Range::above(0.0, 500.0);
        /// Speed at which the target of each finger moves.
        speed: f64 = 0.2, "m/s", Range::above(0.0, 2.0);
        /// Mass of each finger with its sensor.
        finger_mass: f64 = 0.1, "kg", Range::above(0.0, 10.0);
    }
}

softvt_common::settings! {
    /// Errors of the gripper width that policies measure: an offset, noise, then rounding to steps. Drives and experts
    /// use the exact width.
    ///
    /// The default has the steps of a Robotiq 2F-85 (0.4 mm at the fingertips, instruction manual; no figure of the
    /// Franka Hand was found) and an offset of half the largest error that Mecademic states for the MEGP 25 (0.5 mm,
    /// manual of firmware 11.3, `GetRtGripperPos`), as the standard deviation. Noise before rounding is off: averaging
    /// it would measure less than a step.
    pub struct WidthSensorSpec {
        /// Step of the measured width; 0 for none.
        resolution: f64 = 4e-4, "m", Range::closed(0.0, 0.01);
        /// Standard deviation of the error that is constant in an episode.
        offset: f64 = 2.5e-4, "m", Range::closed(0.0, 0.01);
        /// Standard deviation of the noise, new in every control step.
        noise: f64 = 0.0, "m", Range::closed(0.0, 0.01);
    }
}

softvt_common::settings! {
    /// Friction of the gel pads. Their elasticity is that of `tactile.gel`.
    pub struct PadSpec {
        /// Friction coefficient while the pad sticks.
        static_mu: f64 = 1.5, "", Range::closed(0.0, 100.0);
        /// Dynamic friction coefficient, not above the static one.
        dynamic_mu: f64 = 1.2, "", Range::closed(0.0, 100.0);
    }
}

softvt_common::settings! {
    /// Differential inverse kinematics by damped least squares.
    pub struct IkSpec {
        /// Damping λ of the least squares, in the mixed unit (m and rad per rad) of the Jacobian's singular values.
        /// Larger values are slower and more robust near singularities.
        lambda: f64 = 0.01, "", Range::above(0.0, 10.0);
        /// Share of the way to the rest posture that the null space covers per control step, 0..=1.
        posture_gain: f64 = 0.0, "", Range::closed(0.0, 1.0);
    }
}

softvt_common::settings! {
    /// Random offset between the commanded and the executed tool pose: a stationary Gauss–Markov process per axis
    /// (Gardiner, *Stochastic Methods*, 2009, 4.5.4), different in every episode. Off by default.
    ///
    /// Demonstrations that are recorded with it hold the expert's commands, not the disturbed ones, and so show how to
    /// correct deviations (Laskey et al., *DART*, 2017).
    pub struct DisturbanceSpec {
        /// Standard deviation of the position along each axis.
        position: f64 = 0.0, "m", Range::closed(0.0, 0.05);
        /// Standard deviation of the rotation about each axis.
        rotation: f64 = 0.0, "rad", Range::closed(0.0, 0.5);
        /// Time after which the correlation of the offset has fallen to 1/e.
        duration: f64 = 0.5, "s", Range::above(0.0, 1e3);
    }
}

/// One of the two fingers, with its pad and tactile sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// `panda_leftfinger`, which opens along +y of the hand.
    Left,
    /// `panda_rightfinger`, which opens along −y of the hand.
    Right,
}

impl Side {
    /// Left, then right: the order of all arrays over fingers.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// 0 for left, 1 for right.
    pub fn index(self) -> usize {
        self as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_invalid_numbers_are_named() {
        RobotSpec::default().validate().expect("defaults");
        let mut spec = RobotSpec::default();
        spec.gripper.kp = -1.0;
        assert_eq!(
            spec.validate().expect_err("negative").to_string(),
            "robot.gripper.kp: expected a number in above 0..1000000 (N/m), got -1"
        );
        spec = RobotSpec::default();
        spec.ik.posture_gain = f64::NAN;
        assert!(
            spec.validate()
                .expect_err("NaN")
                .to_string()
                .contains("ik.posture_gain: expected a number in 0..1")
        );
        spec = RobotSpec::default();
        spec.pads.dynamic_mu = 1.6;
        assert_eq!(
            spec.validate().expect_err("above static").to_string(),
            "robot.pads.dynamic_mu: expected a number in 0..1.5, got 1.6"
        );
    }
}
