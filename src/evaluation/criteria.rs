//! Every threshold of the judge in one place.

use serde::{Deserialize, Serialize};

use softvt_common::text::{NOT_NEGATIVE, RangeError, check_range};

/// Thresholds that decide when an object counts as lifted, lost, dropped, slipped, released or placed.
///
/// The default is the benchmark; a suite or `--set criteria.slip_m=…` may change each of them. The definitions that
/// use them are in [`super::drop`], [`super::slip`], [`super::goal`] and [`super::judge`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SuccessCriteria {
    /// Minimum force that counts as contact, of a pad, another part of the robot or a support, N.
    pub touch_force_n: f64,
    /// Minimum rise of a body's lowest point above its settled height that counts as lifted, m.
    pub lift_height_m: f64,
    /// Time without pad contact after which a grasp may count as lost, s (0.15 s: three control steps).
    pub lost_contact_s: f64,
    /// Fall relative to the hand beyond which a lost grasp is a drop, m.
    pub lost_fall_m: f64,
    /// Length of a free fall beyond which it is a drop, before or after the release, m.
    pub free_fall_m: f64,
    /// Excess of the commanded over the measured gripper width that counts as a release command, m.
    pub release_margin_m: f64,
    /// Largest allowed travel of the contact patch along a pad while the pads carry the object, m: NoSlip, which is not part of NoDrop.
    pub slip_m: f64,
    /// True if Safety Success needs NoSlip.
    pub require_no_slip: bool,
    /// Largest grip ratio of a gentle grip.
    pub gentle_ratio: f64,
    /// Minimum share of the target's weight that the goal must carry, 0 to 1.
    pub support_share: f64,
    /// Distance of the centre beyond the goal's edge at which a placed object has left the goal, m.
    pub leave_margin_m: f64,
    /// Horizontal and vertical distance within which SoftVTBench's released code counts an object as "on", m.
    pub goal_v1_on_m: f64,
    /// Horizontal and vertical distance within which SoftVTBench's released code counts an object as "in", m.
    pub goal_v1_in_m: f64,
}

impl Default for SuccessCriteria {
    fn default() -> Self {
        Self {
            touch_force_n: 1e-3,
            lift_height_m: 0.005,
            lost_contact_s: 0.15,
            lost_fall_m: 0.020,
            free_fall_m: 0.050,
            release_margin_m: 0.005,
            slip_m: 0.002,
            require_no_slip: false,
            gentle_ratio: 2.0,
            support_share: 0.5,
            leave_margin_m: 0.005,
            goal_v1_on_m: 0.10,
            goal_v1_in_m: 0.20,
        }
    }
}

impl SuccessCriteria {
    /// Checks that every threshold is finite and not negative, and that the share is at most 1.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn validate(&self) -> Result<(), RangeError> {
        let criteria = [
            ("touch_force_n", self.touch_force_n),
            ("lift_height_m", self.lift_height_m),
            ("lost_contact_s", self.lost_contact_s),
            ("lost_fall_m", self.lost_fall_m),
            ("free_fall_m", self.free_fall_m),
            ("release_margin_m", self.release_margin_m),
            ("slip_m", self.slip_m),
            ("gentle_ratio", self.gentle_ratio),
            ("support_share", self.support_share),
            ("leave_margin_m", self.leave_margin_m),
            ("goal_v1_on_m", self.goal_v1_on_m),
            ("goal_v1_in_m", self.goal_v1_in_m),
        ];
        for (name, value) in criteria {
            check_range(&format!("criteria.{name}"), value, NOT_NEGATIVE, "a finite number, at least 0")?;
        }
        check_range("criteria.support_share", self.support_share, 0.0..=1.0, "a share in 0..1")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_in_range_and_a_bad_criterion_is_named() {
        assert_eq!(SuccessCriteria::default().validate(), Ok(()));
        let slip = SuccessCriteria { slip_m: -0.001, ..SuccessCriteria::default() }.validate().unwrap_err();
        assert_eq!(slip.to_string(), "criteria.slip_m: expected a finite number, at least 0, got -0.001");
        assert!(SuccessCriteria { lost_fall_m: f64::NAN, ..SuccessCriteria::default() }.validate().is_err());
        assert!(SuccessCriteria { support_share: 1.5, ..SuccessCriteria::default() }.validate().is_err());
    }

    #[test]
    fn a_script_may_set_one_criterion_and_keeps_the_others() {
        let criteria: SuccessCriteria = serde_json::from_str(r#"{"slip_m":0.001}"#).unwrap();
        assert_eq!(criteria, SuccessCriteria { slip_m: 0.001, ..SuccessCriteria::default() });
        assert!(serde_json::from_str::<SuccessCriteria>(r#"{"slip":0.001}"#).is_err());
    }
}
