//! Parameters of the robot that experiments may change, with defaults and ranges.

use serde::{Deserialize, Serialize};

use softvt_common::text::{POSITIVE, RangeError, check_range};

/// Parameters of arm, gripper, pads and inverse kinematics; the settings `robot.*` of an experiment.
///
/// Missing fields take their defaults, unknown fields are errors. [`Self::validate`] checks the ranges.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotSpec {
    /// Joint drives of the arm.
    pub arm: ArmSpec,
    /// Finger drives.
    pub gripper: GripperSpec,
    /// Contact of the gel pads.
    pub pads: PadSpec,
    /// Inverse kinematics.
    pub ik: IkSpec,
    /// Errors of the measured gripper width.
    pub width_sensor: WidthSensorSpec,
    /// Delay between a command and the robot's response, control steps of 0.05 s.
    pub latency: u32,
    /// Random offset of the executed poses from the commanded ones.
    pub disturbance: DisturbanceSpec,
}

/// Longest [`RobotSpec::latency`], control steps: 5 s.
const MAX_LATENCY: u32 = 100;

impl RobotSpec {
    /// Checks that every number is finite and in its range.
    ///
    /// # Errors
    /// The first field out of its range.
    pub fn validate(&self) -> Result<(), RangeError> {
        let (arm, gripper, pads, ik) = (&self.arm, &self.gripper, &self.pads, &self.ik);
        positive("arm.kp", arm.kp, "N m/rad")?;
        positive("arm.kd", arm.kd, "N m s/rad")?;
        positive("gripper.kp", gripper.kp, "N/m")?;
        positive("gripper.kd", gripper.kd, "N s/m")?;
        positive("gripper.effort", gripper.effort, "N")?;
        positive("gripper.speed", gripper.speed, "m/s")?;
        positive("gripper.finger_mass", gripper.finger_mass, "kg")?;
        within("latency", f64::from(self.latency), f64::from(MAX_LATENCY))?;
        within("disturbance.position", self.disturbance.position, 0.05)?;
        within("disturbance.rotation", self.disturbance.rotation, 0.5)?;
        positive("disturbance.duration", self.disturbance.duration, "s")?;
        within("width_sensor.resolution", self.width_sensor.resolution, 0.01)?;
        within("width_sensor.offset", self.width_sensor.offset, 0.01)?;
        within("width_sensor.noise", self.width_sensor.noise, 0.01)?;
        positive("ik.lambda", ik.lambda, "1")?;
        within("ik.posture_gain", ik.posture_gain, 1.0)?;
        positive("pads.normal_modulus", pads.normal_modulus, "Pa/m")?;
        positive("pads.tangential_modulus", pads.tangential_modulus, "Pa/m")?;
        within("pads.static_mu", pads.static_mu, f64::MAX)?;
        within("pads.dynamic_mu", pads.dynamic_mu, pads.static_mu)
    }
}

fn within(field: &str, value: f64, highest: f64) -> Result<(), RangeError> {
    let expected = if highest == f64::MAX { "0 or more".into() } else { format!("0 to {highest}") };
    check_range(&format!("robot.{field}"), value, 0.0..=highest, &expected)
}

fn positive(field: &str, value: f64, unit: &str) -> Result<(), RangeError> {
    check_range(&format!("robot.{field}"), value, POSITIVE, &format!("a positive number ({unit})"))
}

/// Joint drives of the arm: `τ = kp (q_target − q) − kd q̇`, limited to the torques of the real arm (the effort
/// limits of [`panda::tree`](super::panda::tree)), in addition to exact gravity compensation. The same gains
/// apply to all joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmSpec {
    /// Stiffness, N m/rad; positive.
    pub kp: f64,
    /// Damping, N m s/rad; positive.
    pub kd: f64,
}

impl Default for ArmSpec {
    fn default() -> Self {
        Self { kp: 8000.0, kd: 800.0 }
    }
}

/// Drive of each finger: `f = kp (q_target − q) − kd q̇`, limited to `effort`. The opening range is fixed
/// by the hardware ([`MAX_WIDTH`](super::gripper::MAX_WIDTH)).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GripperSpec {
    /// Stiffness, N/m; positive.
    pub kp: f64,
    /// Damping, N s/m; positive.
    pub kd: f64,
    /// Largest force per finger, N. The real hand holds 70 N continuously (Franka Emika, Hand data sheet); the paper's simulator has 200 N.
    pub effort: f64,
    /// Speed at which the target of each finger moves, m/s.
    pub speed: f64,
    /// Mass of each finger with its sensor, kg.
    pub finger_mass: f64,
}

impl Default for GripperSpec {
    fn default() -> Self {
        Self { kp: 2000.0, kd: 100.0, effort: 70.0, speed: 0.2, finger_mass: 0.1 }
    }
}

/// Errors of the gripper width that policies measure: an offset, noise, then rounding to steps. Drives and experts use the
/// exact width.
///
/// The default has the steps of a Robotiq 2F-85 (0.4 mm at the fingertips, instruction manual; no figure of the Franka
/// Hand was found) and an offset of half the largest error that Mecademic states for the MEGP 25 (0.5 mm, manual of
/// firmware 11.3, `GetRtGripperPos`), as the standard deviation. Noise before rounding is off: averaging it would measure
/// less than a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WidthSensorSpec {
    /// Step of the measured width, m; 0 for none.
    pub resolution: f64,
    /// Standard deviation of the error that is constant in an episode, m.
    pub offset: f64,
    /// Standard deviation of the noise, new in every control step, m.
    pub noise: f64,
}

impl Default for WidthSensorSpec {
    fn default() -> Self {
        Self { resolution: 4e-4, offset: 2.5e-4, noise: 0.0 }
    }
}

/// Contact of the gel pads: friction, and the compliance of gel and sensor per contact area (a model of the 4 mm gel
/// for wide patches). It determines force and slip; tactile images are computed from a model of their own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PadSpec {
    /// Normal stress per indentation, Pa/m.
    pub normal_modulus: f64,
    /// Shear stress per tangential displacement, Pa/m.
    pub tangential_modulus: f64,
    /// Friction coefficient while the pad sticks.
    pub static_mu: f64,
    /// Dynamic friction coefficient, not above the static one.
    pub dynamic_mu: f64,
}

impl Default for PadSpec {
    fn default() -> Self {
        Self { normal_modulus: 3e8, tangential_modulus: 4e7, static_mu: 1.5, dynamic_mu: 1.2 }
    }
}

/// Differential inverse kinematics by damped least squares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IkSpec {
    /// Damping λ of the least squares, in the mixed unit (m and rad per rad) of the Jacobian's singular values;
    /// positive. Larger values are slower and more robust near singularities.
    pub lambda: f64,
    /// Share of the way to the rest posture that the null space covers per control step, 0..=1.
    pub posture_gain: f64,
}

impl Default for IkSpec {
    fn default() -> Self {
        Self { lambda: 0.01, posture_gain: 0.0 }
    }
}

/// Random offset between the commanded and the executed tool pose: a stationary Gauss–Markov process per axis (Gardiner,
/// *Stochastic Methods*, 2009, 4.5.4), different in every episode. Off by default.
///
/// Demonstrations that are recorded with it hold the expert's commands, not the disturbed ones, and so show how to correct
/// deviations (Laskey et al., *DART*, 2017).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DisturbanceSpec {
    /// Standard deviation of the position along each axis, m.
    pub position: f64,
    /// Standard deviation of the rotation about each axis, rad.
    pub rotation: f64,
    /// Time after which the correlation of the offset has fallen to 1/e, s; positive.
    pub duration: f64,
}

impl Default for DisturbanceSpec {
    fn default() -> Self {
        Self { position: 0.0, rotation: 0.0, duration: 0.5 }
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
            "robot.gripper.kp: expected a positive number (N/m), got -1"
        );
        spec = RobotSpec::default();
        spec.ik.posture_gain = f64::NAN;
        assert!(spec.validate().expect_err("NaN").to_string().contains("ik.posture_gain: expected 0 to 1"));
        spec = RobotSpec::default();
        spec.pads.dynamic_mu = 1.6;
        assert_eq!(
            spec.validate().expect_err("above static").to_string(),
            "robot.pads.dynamic_mu: expected 0 to 1.5, got 1.6"
        );
    }
}
