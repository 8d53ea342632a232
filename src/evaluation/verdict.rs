//! [`Verdict`] on an episode, and [`Outcome`] of its rollout.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{
    drop::DropEvent,
    safety::{KappaVerdict, PeakDeformation},
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

/// Judgement of one episode. Percentages are of the diagonal of the settled bounding box.
///
/// [`super::judge`] defines each field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Goal Success: the target rested at its goal, released, for long enough.
    pub goal: bool,
    /// Time at which the goal had held for long enough, s; null without success.
    pub goal_time_s: Option<f64>,
    /// Goal Success by the looser predicate of SoftVTBench's released code.
    pub goal_v1: bool,
    /// NoDrop: none of the events of [`super::drop`] happened.
    pub no_drop: bool,
    /// The first event that made NoDrop false.
    pub drop: Option<DropEvent>,
    /// NoSlip; part of Safety Success only if the criteria require it.
    pub no_slip: bool,
    /// Distance that the target slid along a pad while the pads alone carried it, mm; the worse pad.
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
    /// Safety Success: goal, no drop, for a soft target D_peak ≤ τ, and no slip if the criteria require it.
    pub safety: bool,
    /// True if the evidence suffices to judge safety.
    pub safety_known: bool,
    /// Safety at each κ of the sensitivity table.
    pub kappas: Vec<KappaVerdict>,
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
}
