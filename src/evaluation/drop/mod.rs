//! NoDrop: when an object counts as dropped, and when a release was commanded.
//!
//! NoDrop is false from the first of these events on, also when the object is caught again:
//! - **lost grasp**: the object was lifted at its last pad contact. Since then at least `lost_contact_s` have passed
//!   without pad contact and without a release command, and its centre has fallen by more than `lost_fall_m` relative
//!   to the hand. It does not matter whether it has landed meanwhile.
//! - **free fall**: neither the robot nor a support touches the object, and its centre is more than `free_fall_m` below
//!   its highest point since the last contact, released or not.
//! - **left goal**: the object has rested at the goal for a control step, and at the end of a later one its centre is
//!   outside the goal region by more than `leave_margin_m` ([`super::goal`]).
//! - **left workspace**: the centre is outside the workspace of the scene.
//! - **no evidence**: the rollout was invalid or a number was not finite.

use serde::{Deserialize, Serialize};

use super::{criteria::SuccessCriteria, evidence::GripperEvidence};

/// Reason why NoDrop is false.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DropReason {
    /// Both pads lost the lifted object, which then fell relative to the hand without a release command.
    LostGrasp,
    /// It fell freely for too far.
    FreeFall,
    /// It rested at the goal and left it again.
    LeftGoal,
    /// Its centre left the workspace.
    LeftWorkspace,
    /// The rollout was invalid or evidence is missing, so that a drop cannot be excluded.
    NoEvidence,
}

/// The first event that made NoDrop false.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DropEvent {
    /// Kind of the event.
    pub reason: DropReason,
    /// Time of its detection, s since the policy took over.
    pub time_s: f64,
}

/// Detects that the gripper was commanded to release the object.
///
/// A gripper that holds something is commanded narrower than it is. A grasp begins when both pads press on the object
/// while the command is below the measured width. It is released when the commanded width reaches either
/// - the measured width plus [`SuccessCriteria::release_margin_m`], or
/// - the largest width measured in this grasp with both pads on the object.
///
/// The second rule makes opening in many small steps a release as well. A hold that is loosened until it barely holds
/// is not a release. The width at the *first* touch would not do as the bound: it is detected when a fast gripper has
/// closed some millimetres further, and an object that turns in the hand may become wider.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReleaseMonitor {
    is_released: bool,
    /// Largest width with both pads on the object, m; `None` before the first grasp.
    grasp_width_m: Option<f64>,
}

impl ReleaseMonitor {
    /// Takes in one physics step; `both_pads_touch` if both pads press on the target. Returns true if a release of the
    /// last held object has been commanded, now or before; a new grasp resets it to false.
    pub fn update(
        &mut self,
        criteria: &SuccessCriteria,
        gripper: &GripperEvidence,
        both_pads_touch: bool,
    ) -> bool {
        if both_pads_touch && (self.grasp_width_m.is_none() || self.is_released) {
            let is_squeezing = gripper.commanded_width_m < gripper.width_m;
            if is_squeezing {
                *self = Self { is_released: false, grasp_width_m: Some(gripper.width_m) };
            }
        } else if both_pads_touch {
            self.grasp_width_m = self.grasp_width_m.map(|width| width.max(gripper.width_m));
        }
        if let Some(grasp_width_m) = self.grasp_width_m {
            let limit = (gripper.width_m + criteria.release_margin_m).min(grasp_width_m);
            self.is_released |= gripper.commanded_width_m >= limit;
        }
        self.is_released
    }
}

/// One physics step as [`DropMonitor`] reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DropSample {
    /// Time, s.
    pub time_s: f64,
    /// Height of the target's centre, m.
    pub centre_z: f64,
    /// Height of the origin of the hand frame, m.
    pub hand_z: f64,
    /// True if nothing but the robot carries the target and it is clear of its settled place.
    pub is_lifted: bool,
    /// True if at least one pad presses on it.
    pub is_touched: bool,
    /// True if another part of the robot (hand, finger, sensor case) presses on it.
    pub is_touched_by_body: bool,
    /// True if anything but the robot presses on it from below.
    pub is_supported: bool,
    /// True if its release has been commanded.
    pub is_released: bool,
    /// True if its centre is inside the workspace.
    pub is_in_workspace: bool,
}

/// Watches for drops; the first one stays, also when the object is caught again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DropMonitor {
    /// The first drop so far.
    pub first: Option<DropEvent>,
    /// `None` when the object is not carried.
    carried: Option<CarriedState>,
    /// Highest centre since the object was last touched by anything, m.
    airborne_from: Option<f64>,
}

/// State of a carried object since a pad last pressed on it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CarriedState {
    /// Height above the hand at that contact, m.
    above_hand: f64,
    /// Physics steps since that contact.
    free_steps: u32,
    /// Largest fall relative to the hand since that contact, m.
    fall: f64,
}

impl DropMonitor {
    /// Records a drop that was detected elsewhere, unless there was an earlier one.
    pub fn record(&mut self, reason: DropReason, time_s: f64) {
        self.first.get_or_insert(DropEvent { reason, time_s });
    }

    /// Takes in one physics step of length `dt_s`.
    pub fn update(&mut self, criteria: &SuccessCriteria, dt_s: f64, sample: &DropSample) {
        if !sample.is_in_workspace {
            self.record(DropReason::LeftWorkspace, sample.time_s);
        }
        if self.fell_freely(criteria, sample) {
            self.record(DropReason::FreeFall, sample.time_s);
        }
        if self.lost_grasp(criteria, dt_s, sample) {
            self.record(DropReason::LostGrasp, sample.time_s);
        }
    }

    fn fell_freely(&mut self, criteria: &SuccessCriteria, sample: &DropSample) -> bool {
        if sample.is_touched || sample.is_touched_by_body || sample.is_supported {
            // The fall starts at the height of the last contact, not one step below it.
            self.airborne_from = Some(sample.centre_z);
            return false;
        }
        let top = self.airborne_from.map_or(sample.centre_z, |z| z.max(sample.centre_z));
        self.airborne_from = Some(top);
        top - sample.centre_z > criteria.free_fall_m
    }

    fn lost_grasp(&mut self, criteria: &SuccessCriteria, dt_s: f64, sample: &DropSample) -> bool {
        let above_hand = sample.centre_z - sample.hand_z;
        if sample.is_touched {
            let state = CarriedState { above_hand, free_steps: 0, fall: 0.0 };
            self.carried = sample.is_lifted.then_some(state);
            return false;
        }
        if sample.is_released {
            self.carried = None;
            return false;
        }
        // Landing does not reset the state: a fall of 100 mm ends before three control steps have passed.
        let Some(carried) = &mut self.carried else { return false };
        carried.free_steps += 1;
        carried.fall = carried.fall.max(carried.above_hand - above_hand);
        // The tolerance keeps rounding of the product from costing a step.
        let free_s = f64::from(carried.free_steps) * dt_s;
        free_s >= criteria.lost_contact_s - 1e-6 * dt_s && carried.fall > criteria.lost_fall_m
    }
}

#[cfg(test)]
mod tests;
