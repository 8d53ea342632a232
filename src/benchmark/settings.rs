//! The numbers of the mechanics, the robot, the judge and the sensors that a suite or a run may change.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::control::check_dt;
use crate::{evaluation::rules::Rules, physics::Params, robot::RobotSpec, sensing::tactile::TactileSpec};

/// All settings of a run. The default is the benchmark.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// The mechanics.
    pub physics: Params,
    /// The robot.
    pub robot: RobotSpec,
    /// The judge's thresholds.
    pub rules: Rules,
    /// The tactile sensors.
    pub tactile: TactileSpec,
}

impl Settings {
    /// The same with the field at a dotted path set: `robot.pads.static_mu`, `0`.
    ///
    /// # Errors
    /// There is no such field, or the value is not of its type or range; a fragment for people.
    pub fn with(&self, path: &str, value: &str) -> Result<Self, String> {
        self.with_all(&[(path.to_owned(), value.to_owned())])
    }

    /// The same with several fields set; ranges that depend on each other are checked once all of them are.
    ///
    /// # Errors
    /// As [`Settings::with`].
    pub fn with_all(&self, fields: &[(String, String)]) -> Result<Self, String> {
        let mut changed = self.clone();
        for (path, value) in fields {
            changed = changed.replaced(path, value)?;
        }
        changed.check()?;
        Ok(changed)
    }

    fn replaced(&self, path: &str, value: &str) -> Result<Self, String> {
        let mut tree = serde_json::to_value(self).map_err(|e| e.to_string())?;
        let mut at = &mut tree;
        for key in path.split('.') {
            let known: Vec<String> = at.as_object().map_or(Vec::new(), |o| o.keys().cloned().collect());
            at = at.get_mut(key).ok_or_else(|| {
                format!("there is no setting {path}; {key} could be one of {}", known.join(", "))
            })?;
        }
        let parsed = serde_json::from_str::<Value>(value);
        *at = match (&at, parsed) {
            (Value::Object(_), Ok(group @ Value::Object(_))) => group,
            (Value::Object(_), _) => {
                return Err(format!("{path} is a group of settings, not one; name one of its fields"));
            }
            (_, Ok(value)) => value,
            (Value::String(_), Err(_)) => Value::String(value.to_owned()),
            _ => return Err(format!("{path}: expected a number, true or false, got {value:?}")),
        };
        serde_json::from_value(tree).map_err(|e| format!("{path}: {e}"))
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first number out of its range; a fragment for people.
    pub fn check(&self) -> Result<(), String> {
        self.robot.validate().map_err(|e| e.to_string())?;
        self.rules.check().map_err(|e| e.to_string())?;
        self.tactile.validate().map_err(|e| e.to_string())?;
        self.physics.check()?;
        check_dt(self.physics.dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_setting_changes_and_a_wrong_one_says_what_there_is() {
        let settings = Settings::default();
        let changed = settings.with("robot.gripper.effort", "0.2").expect("a setting");
        assert_eq!(changed.robot.gripper.effort, 0.2);
        assert!(settings.with("robot.gripper.efort", "0.2").is_err_and(|e| e.contains("effort")));
        assert!(settings.with("robot.gripper", "1").is_err_and(|e| e.contains("group")));
        assert!(settings.with("physics.dt", "-1").is_err_and(|e| e.contains("physics.dt")));
        let pads =
            |mu: &str| ["static_mu", "dynamic_mu"].map(|key| (format!("robot.pads.{key}"), mu.to_owned()));
        assert!(settings.with("robot.pads.static_mu", "0").is_err(), "the dynamic one would be above it");
        assert_eq!(settings.with_all(&pads("0")).expect("both at once").robot.pads.dynamic_mu, 0.0);
        assert!(settings.with("physics.dt", "fast").is_err_and(|e| e.contains("number")));
    }
}
