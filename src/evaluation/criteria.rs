//! Every threshold of the judge in one place.

use softvt_common::range::Range;

softvt_common::settings! {
    /// Thresholds that decide when an object counts as lifted, lost, dropped, slipped, released or placed.
    ///
    /// The default is the benchmark; a suite or `--set criteria.slip_m=…` may change each of them. The definitions that
    /// use them are in [`super::drop`], [`super::slip`], [`super::goal`] and [`super::judge`].
    pub struct SuccessCriteria {
        /// Minimum force that counts as contact, of a pad, another part of the robot or a support.
        touch_force_n: f64 = 1e-3, "N", Range::closed(0.0, 100.0);
        /// Minimum rise of a body's lowest point above its settled height that counts as lifted.
        lift_height_m: f64 = 0.005, "m", Range::closed(0.0, 0.5);
        /// Time without pad contact after which a grasp may count as lost, s (0.15 s: three control steps).
        lost_contact_s: f64 = 0.15, "s", Range::closed(0.0, 60.0);
        /// Fall relative to the hand beyond which a lost grasp is a drop.
        lost_fall_m: f64 = 0.020, "m", Range::closed(0.0, 0.5);
        /// Length of a free fall beyond which it is a drop, before or after the release.
        free_fall_m: f64 = 0.050, "m", Range::closed(0.0, 0.5);
        /// Excess of the commanded over the measured gripper width that counts as a release command.
        release_margin_m: f64 = 0.005, "m", Range::closed(0.0, 0.5);
        /// Largest allowed distance that the object slides along a pad while the pads alone carry it, m: NoSlip, which
        /// is not part of NoDrop.
        slip_m: f64 = 0.002, "m", Range::closed(0.0, 0.5);
        /// True if Safety Success needs NoSlip.
        require_no_slip: bool = false;
        /// Largest grip ratio of a gentle grip.
        gentle_ratio: f64 = 2.0, "", Range::closed(0.0, 1e3);
        /// Minimum share of the target's weight that the goal must carry, 0 to 1.
        support_share: f64 = 0.5, "", Range::closed(0.0, 1.0);
        /// Distance of the centre beyond the goal's edge at which a placed object has left the goal.
        leave_margin_m: f64 = 0.005, "m", Range::closed(0.0, 0.5);
        /// Horizontal and vertical distance within which SoftVTBench's released code counts an object as "on".
        goal_v1_on_m: f64 = 0.10, "m", Range::closed(0.0, 2.0);
        /// Horizontal and vertical distance within which SoftVTBench's released code counts an object as "in".
        goal_v1_in_m: f64 = 0.20, "m", Range::closed(0.0, 2.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_common::settings::SettingField;

    #[test]
    fn defaults_are_in_range_and_a_bad_criterion_is_named() {
        assert_eq!(SuccessCriteria::default().check("criteria"), Ok(()));
        let slip =
            SuccessCriteria { slip_m: -0.001, ..SuccessCriteria::default() }.check("criteria").unwrap_err();
        assert_eq!(slip.to_string(), "criteria.slip_m: expected a number in 0..0.5 (m), got -0.001");
    }

    #[test]
    fn a_script_may_set_one_criterion_and_keeps_the_others() {
        let criteria: SuccessCriteria = serde_json::from_str(r#"{"slip_m":0.001}"#).unwrap();
        assert_eq!(criteria, SuccessCriteria { slip_m: 0.001, ..SuccessCriteria::default() });
        assert!(serde_json::from_str::<SuccessCriteria>(r#"{"slip":0.001}"#).is_err());
    }
}
