//! NoDrop: when an object counts as dropped, and when the hand was told to let go.

use serde::{Deserialize, Serialize};

use super::rules::Rules;

/// Why NoDrop is false.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DropReason {
    /// Both pads lost the lifted object, which then fell relative to the hand before the release command.
    LostGrasp,
    /// It fell freely for too far.
    FreeFall,
    /// It rested at the goal and left it again.
    LeftGoal,
    /// Its centre left the workspace.
    LeftWorkspace,
    /// The rollout was invalid or its evidence missing: nobody can say that it was not dropped.
    NoEvidence,
}

/// The first thing that made NoDrop false.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drop {
    /// What happened.
    pub reason: DropReason,
    /// When it was noticed, s since the policy took over.
    pub time_s: f64,
}

/// What [`ReleaseWatch`] reads of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Both pads press on the target.
    pub both_touch: bool,
    /// Measured apex-to-apex width, m.
    pub width_m: f64,
    /// Commanded apex-to-apex width, m.
    pub commanded_width_m: f64,
}

/// Knows whether the hand was told to let go.
///
/// A gripper that holds something is commanded narrower than it is. It is told to release when it is commanded wider
/// than it is by [`Rules::release_margin_m`], or as wide as it has been at most with both pads on the object, so that
/// opening in many small steps is a release as well, and a hold that was loosened until it barely holds is none. (The
/// width at the *first* touch would not do: it is noticed when a fast gripper is some millimetres in already, and an
/// object that turns in the hand may become wider.)
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReleaseWatch {
    released: bool,
    touch_width_m: Option<f64>,
}

impl ReleaseWatch {
    /// Looks at one step and says whether the hand has been told to release what it last held.
    pub fn observe(&mut self, rules: &Rules, grip: &Grip) -> bool {
        if grip.both_touch && (self.touch_width_m.is_none() || self.released) {
            let squeezing = grip.commanded_width_m < grip.width_m;
            if squeezing {
                *self = Self { released: false, touch_width_m: Some(grip.width_m) };
            }
        } else if grip.both_touch {
            self.touch_width_m = self.touch_width_m.map(|touch| touch.max(grip.width_m));
        }
        if let Some(touch) = self.touch_width_m {
            let limit = (grip.width_m + rules.release_margin_m).min(touch);
            self.released |= grip.commanded_width_m >= limit;
        }
        self.released
    }
}

/// What [`DropWatch`] reads of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Time, s.
    pub time_s: f64,
    /// Height of the target's centre, m.
    pub centre_z: f64,
    /// Height of the hand, m.
    pub hand_z: f64,
    /// The target is carried by nothing but the pads, clear of where it lay.
    pub lifted: bool,
    /// At least one pad presses on it.
    pub touched: bool,
    /// Another part of the robot presses on it: the hand, a finger, a sensor's case.
    pub handled: bool,
    /// Something other than the robot presses on it from below.
    pub supported: bool,
    /// The hand has been told to release.
    pub released: bool,
    /// Its centre is inside the workspace.
    pub in_workspace: bool,
}

/// Watches for drops; the first one stays, also when the object is caught again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DropWatch {
    first: Option<Drop>,
    /// Height above the hand when a pad last pressed on the lifted object, and steps since; `None` when not carried.
    carried: Option<Carried>,
    /// Highest centre since the object was last touched by anything, m.
    airborne_from: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Carried {
    above_hand: f64,
    free_steps: u32,
    fall: f64,
}

impl DropWatch {
    /// The first drop, if there was one.
    pub fn first(&self) -> Option<Drop> {
        self.first
    }

    /// Records a reason found elsewhere, unless there was an earlier one.
    pub fn note(&mut self, reason: DropReason, time_s: f64) {
        self.first.get_or_insert(Drop { reason, time_s });
    }

    /// Looks at one step of `dt_s`.
    pub fn observe(&mut self, rules: &Rules, dt_s: f64, motion: &Motion) {
        if !motion.in_workspace {
            self.note(DropReason::LeftWorkspace, motion.time_s);
        }
        if self.fell_freely(rules, motion) {
            self.note(DropReason::FreeFall, motion.time_s);
        }
        if self.lost(rules, dt_s, motion) {
            self.note(DropReason::LostGrasp, motion.time_s);
        }
    }

    fn fell_freely(&mut self, rules: &Rules, motion: &Motion) -> bool {
        if motion.touched || motion.handled || motion.supported {
            // The fall starts at the height of the last touch, not one step below it.
            self.airborne_from = Some(motion.centre_z);
            return false;
        }
        let top = self.airborne_from.map_or(motion.centre_z, |z| z.max(motion.centre_z));
        self.airborne_from = Some(top);
        top - motion.centre_z > rules.free_fall_m
    }

    fn lost(&mut self, rules: &Rules, dt_s: f64, motion: &Motion) -> bool {
        let above_hand = motion.centre_z - motion.hand_z;
        if motion.touched {
            self.carried = motion.lifted.then_some(Carried { above_hand, free_steps: 0, fall: 0.0 });
            return false;
        }
        if motion.released {
            self.carried = None;
            return false;
        }
        // Where it lands does not matter: a fall of 100 mm ends before three control steps have passed.
        let Some(carried) = &mut self.carried else { return false };
        carried.free_steps += 1;
        carried.fall = carried.fall.max(carried.above_hand - above_hand);
        lasts(carried.free_steps, dt_s, rules.lost_contact_s) && carried.fall > rules.lost_fall_m
    }
}

/// Whether `steps` of `dt_s` last at least `duration_s`; rounding of the product does not cost a step.
fn lasts(steps: u32, dt_s: f64, duration_s: f64) -> bool {
    f64::from(steps) * dt_s >= duration_s - 1e-6 * dt_s
}

#[cfg(test)]
#[path = "drop_tests.rs"]
mod tests;
