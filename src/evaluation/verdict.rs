//! [`Verdict`] on an episode, and [`Outcome`] of its rollout.

use std::{fmt, iter};

use serde::{Deserialize, Deserializer, Serialize, Serializer, ser::SerializeMap};

use super::{
    drop::DropEvent,
    safety::{DeformationLimit, KappaVerdict, PeakDeformation, and_known},
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

/// Drop and slip of a target that is not the first. Records have those of the first in the values of all targets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Handling {
    /// NoDrop of this target.
    pub no_drop: bool,
    /// Its first event that made NoDrop false.
    pub drop: Option<DropEvent>,
    /// NoSlip of this target.
    pub no_slip: bool,
    /// Distance that it slid along a pad while the pads alone carried it, mm; the worse pad.
    pub slip_mm: f64,
}

/// Judgement of one target. Percentages are of the diagonal of its settled bounding box.
///
/// [`super::judge`] defines each field.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TargetVerdict {
    /// Name in the scene; `None` for the object of the task, the first target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// True if it is a soft body.
    #[serde(default)]
    pub soft: bool,
    /// Drop and slip; `None` for the object of the task.
    #[serde(flatten)]
    pub handling: Option<Handling>,
    /// Peak D, %; null for a rigid target.
    pub d_peak: Option<f64>,
    /// Peak D as SoftVTBench's released code defines it, %: all nodes alike, along the world's axes. This and the next
    /// four are of the object of the task alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub d_peak_v1: Option<f64>,
    /// Peak of the largest node displacement, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub d_peak_max: Option<f64>,
    /// Mean D over all physics steps, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub d_mean: Option<f64>,
    /// D at the last physics step, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub d_final: Option<f64>,
    /// 95th percentile of D over all physics steps, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub d_p95: Option<f64>,
    /// Time for which D exceeded τ, s; null without a limit.
    pub time_over_tau_s: Option<f64>,
    /// Number of physics steps at which D could not be measured.
    pub missing_deformation: u64,
    /// Largest share of the volume that was beyond the collapse strain of its material at one time, %; null for a
    /// rigid target and for a material without that strain.
    pub collapsed_volume_pct: Option<f64>,
    /// Share of the volume that was ever beyond the damage strain of its material, %; null as above.
    pub damaged_volume_pct: Option<f64>,
    /// κ of the benchmark, the share of D_ref that is allowed; null without a calibration.
    pub kappa: Option<f64>,
    /// τ at the nominal κ, %; null without a calibration.
    pub tau: Option<f64>,
    /// D_ref, %; null without a calibration.
    pub d_ref: Option<f64>,
    /// D_peak ≤ τ; null for a rigid target and where evidence is missing.
    pub deformation_ok: Option<bool>,
    /// Largest normal force on one pad, N.
    pub peak_pad_force_n: f64,
    /// Mean normal force per pad while both pads touched, N.
    pub mean_pad_force_n: f64,
    /// Least force per pad that holds the target on its path ([`super::grip`]), N; null if it was not carried.
    pub least_pad_force_n: Option<f64>,
    /// Largest force on one pad over the least force; null if the target was not carried.
    pub grip_ratio: Option<f64>,
}

impl TargetVerdict {
    /// True if D stayed within κ·D_ref, with the target's own κ if none is given; `None` where that is unknown. A
    /// rigid target always is.
    pub fn is_within(&self, kappa: Option<f64>) -> Option<bool> {
        if !self.soft {
            return Some(true);
        }
        let limit = self.d_ref.zip(kappa.or(self.kappa));
        let tau = limit.map(|(d_ref_pct, kappa)| DeformationLimit { d_ref_pct, kappa }.tau_pct());
        PeakDeformation { d_pct: self.d_peak, missing: self.missing_deformation }.is_within(tau)
    }

    /// Peak D over τ; `None` without either.
    pub fn ratio(&self) -> Option<f64> {
        self.d_peak.zip(self.tau.filter(|tau| *tau > 0.0)).map(|(d_peak, tau)| d_peak / tau)
    }
}

/// Judgement of one episode. The [targets](Self::targets) have the measures of each object that the task moves;
/// *the object* is the first of them.
///
/// [`super::judge`] defines each field.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(remote = "Self")]
pub struct Verdict {
    /// Goal Success: the goal held, its placements released and for long enough.
    pub goal: bool,
    /// Time at which the goal had held for long enough, s; null without success.
    pub goal_time_s: Option<f64>,
    /// True if the goal was reached although the robot never touched a target.
    #[serde(default)]
    pub goal_untouched: bool,
    /// Goal Success by the looser predicate of SoftVTBench's released code.
    pub goal_v1: bool,
    /// The predicates of a goal of several parts.
    #[serde(default)]
    pub goal_parts: Vec<GoalPart>,
    /// NoDrop: none of the events of [`super::drop`] happened to a target.
    pub no_drop: bool,
    /// The first event that made NoDrop false.
    pub drop: Option<DropEvent>,
    /// NoSlip; part of Safety Success only if the criteria require it.
    pub no_slip: bool,
    /// Distance that a target slid along a pad while the pads alone carried it, mm; the worse pad and the worst target.
    pub slip_mm: f64,
    /// Peak D over the other soft bodies, the object at the goal included, %.
    pub d_peak_other: Option<f64>,
    /// The other soft bodies, one by one.
    #[serde(default)]
    pub others: Vec<OtherObjectDeformation>,
    /// No other soft body exceeded its own τ; null where that is unknown.
    pub others_ok: Option<bool>,
    /// First contact of the robot with a movable object that is not the target; null without one.
    pub first_wrong_contact: Option<WrongObjectContact>,
    /// Stage at which an episode without Goal Success ended; null with it.
    pub failed_stage: Option<TaskStage>,
    /// True if the first object that was lifted is not the target.
    pub wrong_instance: bool,
    /// NoSlip where the criteria require it; null otherwise, and if the episode is invalid.
    pub slip_ok: Option<bool>,
    /// Safety Success: goal, no drop, D_peak ≤ τ for each soft target, and no slip if the criteria require it.
    pub safety: bool,
    /// True if the evidence suffices to judge safety.
    pub safety_known: bool,
    /// Safety at each κ of the sensitivity table, with the limit of the object.
    pub kappas: Vec<KappaVerdict>,
    /// The objects that the task moves, *the object* first; at least one. Files have the keys of the first next to
    /// those of the episode, and the others in a list `targets`.
    #[serde(default)]
    pub targets: Vec<TargetVerdict>,
    /// Number of physics steps whose evidence was not finite.
    pub missing_evidence: u64,
    /// Goal Success with contact of both pads throughout the carry.
    pub contact_success: bool,
    /// Contact success with Safety Success and NoSlip.
    pub contact_safety: bool,
    /// Goal Success with a grip ratio of at most `criteria.gentle_ratio`.
    pub gentle: bool,
}

impl Verdict {
    /// The first target, *the object*.
    pub fn object(&self) -> &TargetVerdict {
        &self.targets[0]
    }

    /// The first target, to change it.
    pub fn object_mut(&mut self) -> &mut TargetVerdict {
        &mut self.targets[0]
    }

    /// The targets that deform.
    pub fn soft_targets(&self) -> impl Iterator<Item = &TargetVerdict> {
        self.targets.iter().filter(|target| target.soft)
    }

    /// True if D of each target stayed within κ·D_ref, with its own κ if none is given; false if one is known to exceed
    /// it, `None` where neither is known. Outcomes do not enter.
    pub fn is_within(&self, kappa: Option<f64>) -> Option<bool> {
        self.targets.iter().map(|target| target.is_within(kappa)).fold(Some(true), and_known)
    }

    /// Safety Success with κ·D_ref as the limit of each target, or its own limit if no κ is given. Outcomes do not
    /// enter. Deformation that is unknown is not safe.
    pub fn is_safe(&self, kappa: Option<f64>) -> bool {
        self.goal && self.no_drop && self.slip_ok != Some(false) && self.is_within(kappa) == Some(true)
    }

    /// The target with the largest of a quantity; `None` if none has it.
    pub fn largest_by(&self, of: fn(&TargetVerdict) -> Option<f64>) -> Option<&TargetVerdict> {
        let known = self.targets.iter().filter(|target| of(target).is_some());
        known.reduce(|largest, next| if of(next) > of(largest) { next } else { largest })
    }

    /// The soft target with the largest peak D over τ; `None` without any that has both.
    pub fn most_deformed(&self) -> Option<&TargetVerdict> {
        self.largest_by(TargetVerdict::ratio)
    }
}

impl Serialize for Verdict {
    /// Writes the keys in the order of the result files, in which those of the object lie among those of the episode.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // Exhaustive, so that no field is forgotten.
        #[rustfmt::skip]
        let Self {
            goal, goal_time_s, goal_untouched, goal_v1, goal_parts, no_drop, drop, no_slip, slip_mm, d_peak_other, others,
            others_ok, first_wrong_contact, failed_stage, wrong_instance, slip_ok, safety, safety_known, kappas, targets,
            missing_evidence, contact_success, contact_safety, gentle,
        } = self;
        #[rustfmt::skip]
        let TargetVerdict {
            object: _, soft: _, handling: _, d_peak, d_peak_v1, d_peak_max, d_mean, d_final, d_p95, time_over_tau_s,
            missing_deformation, collapsed_volume_pct, damaged_volume_pct, kappa, tau, d_ref, deformation_ok,
            peak_pad_force_n, mean_pad_force_n, least_pad_force_n, grip_ratio,
        } = self.object();
        let mut map = serializer.serialize_map(None)?;
        macro_rules! put {
            ($($key:ident),* $(,)?) => { $( map.serialize_entry(stringify!($key), $key)?; )* };
            ($key:ident if $is:expr) => { if $is { put!($key); } };
        }
        put!(goal, goal_time_s);
        put!(goal_untouched if *goal_untouched);
        put!(goal_v1);
        put!(goal_parts if !goal_parts.is_empty());
        put!(no_drop, drop, no_slip, slip_mm, d_peak, d_peak_v1, d_peak_max, d_mean, d_final, d_p95);
        put!(time_over_tau_s, d_peak_other);
        put!(others if !others.is_empty());
        put!(others_ok, first_wrong_contact, failed_stage, collapsed_volume_pct, damaged_volume_pct);
        put!(wrong_instance, kappa, tau, d_ref, deformation_ok, slip_ok, safety, safety_known, kappas);
        let targets = &targets[1..];
        put!(targets if !targets.is_empty());
        put!(missing_evidence, missing_deformation, contact_success, contact_safety, peak_pad_force_n);
        put!(mean_pad_force_n, least_pad_force_n, grip_ratio, gentle);
        map.end()
    }
}

/// A verdict as files have it.
#[derive(Deserialize)]
struct FlatVerdict {
    #[serde(flatten, deserialize_with = "Verdict::deserialize")]
    episode: Verdict,
    /// With `soft` of the header of the record.
    #[serde(flatten)]
    object: TargetVerdict,
}

impl<'de> Deserialize<'de> for Verdict {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let FlatVerdict { episode, object } = FlatVerdict::deserialize(deserializer)?;
        let object = TargetVerdict { object: None, handling: None, ..object };
        let targets = iter::once(object).chain(episode.targets).collect();
        Ok(Self { targets, ..episode })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn soft(object: Option<&str>, d_peak: f64) -> TargetVerdict {
        TargetVerdict {
            object: object.map(str::to_owned),
            soft: true,
            handling: object.map(|_| Handling::default()),
            d_peak: Some(d_peak),
            kappa: Some(0.5),
            tau: Some(1.0),
            d_ref: Some(2.0),
            ..TargetVerdict::default()
        }
    }

    #[test]
    fn safety_needs_every_part_and_each_soft_target_within_its_limit() {
        let safe =
            Verdict { goal: true, no_drop: true, targets: vec![soft(None, 0.9)], ..Verdict::default() };
        assert!(safe.is_safe(None) && !safe.is_safe(Some(0.3)));
        assert!(!Verdict { goal: false, ..safe.clone() }.is_safe(None));
        assert!(!Verdict { no_drop: false, ..safe.clone() }.is_safe(None));
        assert!(!Verdict { slip_ok: Some(false), ..safe.clone() }.is_safe(None));
        let with = |other: TargetVerdict| Verdict { targets: vec![soft(None, 0.9), other], ..safe.clone() };
        let over = with(soft(Some("roll"), 1.1));
        assert_eq!((over.is_within(None), over.is_safe(None)), (Some(false), false));
        let unknown = with(TargetVerdict { d_peak: None, ..soft(Some("roll"), 0.0) });
        assert_eq!((unknown.is_within(None), unknown.is_safe(None)), (None, false));
        assert!(
            with(TargetVerdict { soft: false, ..unknown.targets[1].clone() }).is_safe(None),
            "a rigid one"
        );
    }

    #[test]
    fn files_have_the_first_target_beside_the_episode_and_the_others_in_a_list() {
        let targets = vec![soft(None, 0.9), soft(Some("roll"), 1.1)];
        let verdict = Verdict { slip_mm: 0.5, targets, ..Verdict::default() };
        let mut json = serde_json::to_value(&verdict).unwrap();
        assert_eq!((&json["d_peak"], &json["targets"][0]["d_peak"]), (&0.9.into(), &1.1.into()));
        assert_eq!(
            (&json["object"], &json["targets"][0]["object"]),
            (&serde_json::Value::Null, &"roll".into())
        );
        assert!(json["targets"].as_array().is_some_and(|others| others.len() == 1));
        // The header of the record has it.
        json["soft"] = true.into();
        assert_eq!(serde_json::from_value::<Verdict>(json).unwrap(), verdict);
    }
}
