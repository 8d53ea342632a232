//! Every threshold of the judging in one place.

use serde::{Deserialize, Serialize};

/// When something counts as lifted, lost, dropped, slipped, released or placed. A script may set each of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rules {
    /// A pad or a support that presses with less than this does not touch, N.
    pub touch_force_n: f64,
    /// A body is lifted when nothing but the pads carries it and its lowest point is this far above where it lay, m.
    pub lift_height_m: f64,
    /// A grasp is lost after this long without normal force on either pad, s (three control steps).
    pub lost_contact_s: f64,
    /// A lost grasp is a drop once the object fell this far relative to the hand before the release command, m.
    pub lost_fall_m: f64,
    /// A free fall longer than this is a drop, released or not, m.
    pub free_fall_m: f64,
    /// The hand is told to release when the commanded width exceeds the measured one by this, m.
    pub release_margin_m: f64,
    /// Tangential travel of a held patch along its pad that counts as slip, m. Reported, not part of NoDrop.
    pub slip_m: f64,
    /// Share of its weight that the goal must carry for the object to rest there.
    pub support_share: f64,
    /// How far outside of the goal's edge a placed object's centre must be to have left it, m.
    pub leave_margin_m: f64,
    /// Horizontal and vertical distance within which the released code calls an object "on", m.
    pub goal_v1_on_m: f64,
    /// Horizontal and vertical distance within which the released code calls an object "in", m.
    pub goal_v1_in_m: f64,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            touch_force_n: 1e-3,
            lift_height_m: 0.005,
            lost_contact_s: 0.15,
            lost_fall_m: 0.020,
            free_fall_m: 0.050,
            release_margin_m: 0.005,
            slip_m: 0.002,
            support_share: 0.5,
            leave_margin_m: 0.005,
            goal_v1_on_m: 0.10,
            goal_v1_in_m: 0.20,
        }
    }
}

/// A rule outside of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("rules.{name}: expected {expected}, got {}", crate::text::format_number(*.value))]
pub struct RuleError {
    name: &'static str,
    expected: &'static str,
    value: f64,
}

impl Rules {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first rule that is not finite or out of range.
    pub fn check(&self) -> Result<(), RuleError> {
        let rules = [
            ("touch_force_n", self.touch_force_n),
            ("lift_height_m", self.lift_height_m),
            ("lost_contact_s", self.lost_contact_s),
            ("lost_fall_m", self.lost_fall_m),
            ("free_fall_m", self.free_fall_m),
            ("release_margin_m", self.release_margin_m),
            ("slip_m", self.slip_m),
            ("support_share", self.support_share),
            ("leave_margin_m", self.leave_margin_m),
            ("goal_v1_on_m", self.goal_v1_on_m),
            ("goal_v1_in_m", self.goal_v1_in_m),
        ];
        for (name, value) in rules {
            if !(value.is_finite() && value >= 0.0) {
                return Err(RuleError { name, expected: "a finite number, at least 0", value });
            }
        }
        if self.support_share > 1.0 {
            return Err(RuleError {
                name: "support_share",
                expected: "a share in 0..1",
                value: self.support_share,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_in_range_and_a_bad_rule_is_named() {
        assert_eq!(Rules::default().check(), Ok(()));
        let slip = Rules { slip_m: -0.001, ..Rules::default() }.check().unwrap_err();
        assert_eq!(slip.to_string(), "rules.slip_m: expected a finite number, at least 0, got -0.001");
        assert!(Rules { lost_fall_m: f64::NAN, ..Rules::default() }.check().is_err());
        assert!(Rules { support_share: 1.5, ..Rules::default() }.check().is_err());
    }

    #[test]
    fn a_script_may_set_one_rule_and_keeps_the_others() {
        let rules: Rules = serde_json::from_str(r#"{"slip_m":0.001}"#).unwrap();
        assert_eq!(rules, Rules { slip_m: 0.001, ..Rules::default() });
        assert!(serde_json::from_str::<Rules>(r#"{"slip":0.001}"#).is_err());
    }
}
