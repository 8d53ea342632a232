//! [`Verdict`] on an episode, and [`Outcome`] of its rollout.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{
    drop::DropEvent,
    safety::{DeformationLimit, KappaVerdict, PeakDeformation, SafetyParts, and_known},
    stage::TaskStage,
};

/// End of a rollout.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Outcome {
    /// The goal held for long enough.
    Completed,
    /// The budget of control steps was spent.
    Budget,
    /// The physics state became invalid.
    Invalid {
        /// Property of the state that was invalid.
        reason: InvalidReason,
        /// Physics step since the policy took over.
        step: u64,
        /// Index of the node concerned, if there is one.
        node: Option<u32>,
    },
    /// The episode could not be run to its end.
    Error {
        /// Message of the error.
        message: String,
    },
}

/// Why a physics state is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InvalidReason {
    /// An element was inverted for too long.
    Inverted,
    /// A position is not a finite number.
    NotFinite,
    /// The contact solve did not converge.
    NotConverged,
    /// The system of a soft body is not positive definite.
    Indefinite,
    /// A body is faster than `physics.max_speed`.
    TooFast,
    /// A contact force is larger than mass and stiffness allow.
    TooHard,
}

impl fmt::Display for InvalidReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inverted => "inverted",
            Self::NotFinite => "not_finite",
            Self::NotConverged => "not_converged",
            Self::Indefinite => "indefinite",
            Self::TooFast => "too_fast",
            Self::TooHard => "too_hard",
        })
    }
}

impl Outcome {
    /// True if the evidence of the rollout can be judged.
    pub fn is_valid(&self) -> bool {
        matches!(self, Self::Completed | Self::Budget)
    }
}

/// First contact of the robot with an object that is not the target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WrongObjectContact {
    /// Time of the contact, s.
    pub time_s: f64,
    /// Name of the object.
    pub object: String,
}

/// Deformation of a soft body that is not the target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OtherObjectDeformation {
    /// Name of the object in the scene.
    pub object: String,
    /// Peak D, %; null if it was never measured.
    pub d_peak: Option<f64>,
    /// τ of the object, %; null without a calibration.
    pub tau: Option<f64>,
    /// D_peak ≤ τ; null where either is unknown.
    pub deformation_ok: Option<bool>,
}

/// A predicate of a goal of several parts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalPart {
    /// Description of the predicate: "bun on plate".
    pub name: String,
    /// True if it must not hold; absent otherwise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub negated: bool,
    /// True if it held at the end.
    pub holds: bool,
    /// Time at which it held first, s; null if it never did.
    pub met_s: Option<f64>,
}

/// Handling of a target that is not the first; the fields are those of the [`Verdict`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct TargetVerdict {
    /// Name of the object in the scene.
    pub object: String,
    /// True if it is a soft body.
    pub soft: bool,
    pub no_drop: bool,
    pub drop: Option<DropEvent>,
    pub no_slip: bool,
    pub slip_mm: f64,
    pub d_peak: Option<f64>,
    pub time_over_tau_s: Option<f64>,
    pub missing_deformation: u64,
    pub collapsed_volume_pct: Option<f64>,
    pub damaged_volume_pct: Option<f64>,
    pub kappa: Option<f64>,
    pub tau: Option<f64>,
    pub d_ref: Option<f64>,
    pub deformation_ok: Option<bool>,
    pub peak_pad_force_n: f64,
    pub mean_pad_force_n: f64,
    pub least_pad_force_n: Option<f64>,
    pub grip_ratio: Option<f64>,
}

impl TargetVerdict {
    /// True if D stayed within κ·D_ref of the target, with its own κ if none is given; `None` where that is unknown. A
    /// rigid target always is.
    pub fn is_within(&self, kappa: Option<f64>) -> Option<bool> {
        if !self.soft {
            return Some(true);
        }
        let limit = self.d_ref.zip(kappa.or(self.kappa));
        let tau = limit.map(|(d_ref_pct, kappa)| DeformationLimit { d_ref_pct, kappa }.tau_pct());
        PeakDeformation { d_pct: self.d_peak, missing: self.missing_deformation }.is_within(tau)
    }
}

/// Judgement of one episode. *The object* is the first target of the task. Percentages are of the diagonal of the
/// settled bounding box.
///
/// [`super::judge`] defines each field.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Goal Success: the goal held, its placements released and for long enough.
    pub goal: bool,
    /// Time at which the goal had held for long enough, s; null without success.
    pub goal_time_s: Option<f64>,
    /// True if the goal was reached although the robot never touched a target.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub goal_untouched: bool,
    /// Goal Success by the looser predicate of SoftVTBench's released code.
    pub goal_v1: bool,
    /// The predicates of a goal of several parts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub goal_parts: Vec<GoalPart>,
    /// NoDrop: none of the events of [`super::drop`] happened to a target.
    pub no_drop: bool,
    /// The first event that made NoDrop false.
    pub drop: Option<DropEvent>,
    /// NoSlip; part of Safety Success only if the criteria require it.
    pub no_slip: bool,
    /// Distance that a target slid along a pad while the pads alone carried it, mm; the worse pad and the worst target.
    pub slip_mm: f64,
    /// Peak D of the target, %; null for a rigid one.
    pub d_peak: Option<f64>,
    /// Peak of the target's D as SoftVTBench's released code defines it, %: all nodes alike, along the world's axes.
    pub d_peak_v1: Option<f64>,
    /// Peak of the largest node displacement of the target, %.
    pub d_peak_max: Option<f64>,
    /// Mean D of the target over all physics steps, %.
    pub d_mean: Option<f64>,
    /// D of the target at the last physics step, %.
    pub d_final: Option<f64>,
    /// 95th percentile of the target's D over all physics steps, %.
    pub d_p95: Option<f64>,
    /// Time for which the target's D exceeded τ, s; null without a limit.
    pub time_over_tau_s: Option<f64>,
    /// Peak D over the other soft bodies, the object at the goal included, %.
    pub d_peak_other: Option<f64>,
    /// The other soft bodies, one by one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<OtherObjectDeformation>,
    /// No other soft body exceeded its own τ; null where that is unknown.
    pub others_ok: Option<bool>,
    /// First contact of the robot with a movable object that is not the target; null without one.
    pub first_wrong_contact: Option<WrongObjectContact>,
    /// Stage at which an episode without Goal Success ended; null with it.
    pub failed_stage: Option<TaskStage>,
    /// Largest share of the target's volume that was beyond the collapse strain of its material at one time, %; null
    /// for a rigid target and for a material without that strain.
    pub collapsed_volume_pct: Option<f64>,
    /// Share of the target's volume that was ever beyond the damage strain of its material, %; null as above.
    pub damaged_volume_pct: Option<f64>,
    /// True if the first object that was lifted is not the target.
    pub wrong_instance: bool,
    /// κ of the benchmark, the share of D_ref that is allowed; null without a calibration.
    pub kappa: Option<f64>,
    /// τ at the nominal κ, %; null without a calibration.
    pub tau: Option<f64>,
    /// D_ref, %; null without a calibration.
    pub d_ref: Option<f64>,
    /// D_peak ≤ τ; null for a rigid target and where evidence is missing.
    pub deformation_ok: Option<bool>,
    /// NoSlip where the criteria require it; null otherwise, and if the episode is invalid.
    pub slip_ok: Option<bool>,
    /// Safety Success: goal, no drop, D_peak ≤ τ for each soft target, and no slip if the criteria require it.
    pub safety: bool,
    /// True if the evidence suffices to judge safety.
    pub safety_known: bool,
    /// Safety at each κ of the sensitivity table.
    pub kappas: Vec<KappaVerdict>,
    /// The other targets, of a task that moves several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<TargetVerdict>,
    /// Number of physics steps whose evidence was not finite.
    pub missing_evidence: u64,
    /// Number of physics steps at which the target's D could not be measured.
    pub missing_deformation: u64,
    /// Goal Success with contact of both pads throughout the carry.
    pub contact_success: bool,
    /// Contact success with Safety Success and NoSlip.
    pub contact_safety: bool,
    /// Largest normal force on one pad, N.
    pub peak_pad_force_n: f64,
    /// Mean normal force per pad while both pads touched, N.
    pub mean_pad_force_n: f64,
    /// Least force per pad that holds the target on its path ([`super::grip`]), N; null if it was not carried.
    pub least_pad_force_n: Option<f64>,
    /// Largest force on one pad over the least force; null if the target was not carried.
    pub grip_ratio: Option<f64>,
    /// Goal Success with a grip ratio of at most `criteria.gentle_ratio`.
    pub gentle: bool,
}

impl Verdict {
    /// The peak deformation of the target, to compare with a limit.
    pub fn peak(&self) -> PeakDeformation {
        PeakDeformation { d_pct: self.d_peak, missing: self.missing_deformation }
    }

    /// True if D of the object stayed within κ·D_ref; `None` for a rigid one and where that is unknown. Outcomes do not
    /// enter.
    pub fn is_within(&self, kappa: f64) -> Option<bool> {
        let limit = self.d_ref.map(|d_ref_pct| DeformationLimit { d_ref_pct, kappa });
        self.peak().is_within(limit.map(|limit| limit.tau_pct()))
    }

    /// Parts of Safety Success other than the deformation of the object, where each of the other targets may use
    /// `kappa` of its D_ref, or its own κ if none is given.
    pub fn safety_parts(&self, kappa: Option<f64>) -> SafetyParts {
        SafetyParts {
            goal: self.goal,
            no_drop: self.no_drop,
            slip_ok: self.slip_ok,
            targets_ok: self.targets.iter().map(|target| target.is_within(kappa)).fold(Some(true), and_known),
        }
    }
}
