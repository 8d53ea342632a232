//! The numbers of the robot that an experiment may want to change, in one place.

use serde::{Deserialize, Serialize};

/// All of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotSpec {
    /// Joint drives of the arm.
    pub arm: ArmSpec,
    /// Finger drives.
    pub gripper: GripperSpec,
    /// Inverse kinematics.
    pub ik: IkSpec,
}

impl RobotSpec {
    /// The profile `paper`: fingers as strong as in the paper's simulator, 200 N.
    pub fn paper() -> Self {
        Self { gripper: GripperSpec { effort: 200.0, ..GripperSpec::default() }, ..Self::default() }
    }

    /// Checks that every number is finite and in its range.
    ///
    /// # Errors
    /// Names the first field that is not, its value and the range.
    pub fn validate(&self) -> Result<(), SpecError> {
        let (arm, gripper, ik) = (&self.arm, &self.gripper, &self.ik);
        positive("arm.kp", arm.kp, "N m/rad")?;
        positive("arm.kd", arm.kd, "N m s/rad")?;
        positive("arm.effort_scale", arm.effort_scale, "1")?;
        positive("gripper.kp", gripper.kp, "N/m")?;
        positive("gripper.kd", gripper.kd, "N s/m")?;
        positive("gripper.effort", gripper.effort, "N")?;
        positive("gripper.speed", gripper.speed, "m/s")?;
        positive("gripper.finger_mass", gripper.finger_mass, "kg")?;
        positive("ik.lambda", ik.lambda, "1")?;
        if !(0.0..=1.0).contains(&ik.posture_gain) {
            return Err(SpecError {
                field: "ik.posture_gain",
                value: ik.posture_gain,
                expected: "0 to 1".into(),
            });
        }
        Ok(())
    }
}

fn positive(field: &'static str, value: f64, unit: &str) -> Result<(), SpecError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(SpecError { field, value, expected: format!("a positive number ({unit})") })
}

/// A number of the robot out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("robot.{field}: expected {expected}, got {value}")]
pub struct SpecError {
    /// Path of the field.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// What it may be.
    pub expected: String,
}

/// Joint drives of the arm: `τ = kp (q_target − q) − kd q̇`, within the torque limits, on top of an exact gravity
/// compensation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmSpec {
    /// Stiffness, N m/rad.
    pub kp: f64,
    /// Damping, N m s/rad.
    pub kd: f64,
    /// Factor on the torque limits of the real arm (87 N m, from the fifth joint on 12 N m).
    pub effort_scale: f64,
}

impl Default for ArmSpec {
    fn default() -> Self {
        Self { kp: 8000.0, kd: 800.0, effort_scale: 1.0 }
    }
}

/// Finger drives: `f = kp (q_target − q) − kd q̇` a finger, within `effort`. How far the gripper opens is its
/// geometry ([`super::gripper::OPENING`]), not a choice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GripperSpec {
    /// Stiffness, N/m.
    pub kp: f64,
    /// Damping, N s/m.
    pub kd: f64,
    /// Largest force of a finger, N. The real hand holds 70 N continuously (Franka Emika, Hand data sheet).
    pub effort: f64,
    /// Speed of a finger's target, m/s.
    pub speed: f64,
    /// Mass of a finger with its sensor, kg.
    pub finger_mass: f64,
}

impl Default for GripperSpec {
    fn default() -> Self {
        Self { kp: 2000.0, kd: 100.0, effort: 70.0, speed: 0.2, finger_mass: 0.1 }
    }
}

/// Differential inverse kinematics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IkSpec {
    /// Damping λ of the least squares, in the mixed unit of the Jacobian's singular values.
    pub lambda: f64,
    /// Share of the way to the rest posture that the null space takes each control step, 0..=1.
    pub posture_gain: f64,
}

impl Default for IkSpec {
    fn default() -> Self {
        Self { lambda: 0.01, posture_gain: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_bad_numbers_are_named() {
        RobotSpec::default().validate().expect("defaults");
        RobotSpec::paper().validate().expect("paper");
        let mut spec = RobotSpec::default();
        spec.gripper.kp = -1.0;
        assert_eq!(
            spec.validate().expect_err("negative").to_string(),
            "robot.gripper.kp: expected a positive number (N/m), got -1"
        );
        spec = RobotSpec::default();
        spec.ik.posture_gain = f64::NAN;
        assert!(spec.validate().expect_err("NaN").to_string().contains("ik.posture_gain"));
    }
}
