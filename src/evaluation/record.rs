//! Record of one episode: one line of `episodes.jsonl`.
//!
//! [`EpisodeRecord`] flattens four parts into one JSON object: the [`EpisodeHeader`] with its id, its [`Outcome`], the
//! [`Verdict`] of the judge and the [`RolloutStats`]. [`super::record_check`] reads a record: what follows from other fields
//! is checked there.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize, Serializer, ser::SerializeMap};

use super::{drop::DropEvent, safety::KappaVerdict, stage::Stage};
use softvt_common::episode_id::EpisodeId;
use softvt_common::text::decimal;
use softvt_scene::{InitialState, SceneVariation};

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
        /// One of "inverted", "not_finite", "not_converged", "too_fast", "too_hard" …
        reason: String,
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

impl Outcome {
    /// True if the evidence of the rollout can be judged.
    pub fn is_valid(&self) -> bool {
        matches!(self, Self::Completed | Self::Budget)
    }
}

/// Id, task, target and policy of an episode: the first columns of its record.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct EpisodeHeader {
    /// Id of the episode.
    #[serde(flatten)]
    pub id: EpisodeId,
    /// Instruction given to the policy.
    pub prompt: String,
    /// Name of the layout.
    pub layout: String,
    /// Name of the policy.
    pub policy: String,
    /// True if the policy sees the true state, as experts do.
    #[serde(default)]
    pub privileged: bool,
    /// Asset of the target.
    pub asset: String,
    /// True if the target is a soft body.
    pub soft: bool,
    /// Changes of the scene by the variation of the suite, if it varies. The policy does not see them.
    #[serde(default)]
    pub variation: Option<Box<SceneVariation>>,
    /// Foreign demonstration that the episode re-executes, if any.
    #[serde(default)]
    pub origin: Option<Box<Origin>>,
}

impl Serialize for EpisodeHeader {
    /// Writes the keys in the order of the result files, in which those of the id are not adjacent.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let EpisodeId { suite, task, episode, base_seed, split } = &self.id;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("suite", suite)?;
        map.serialize_entry("task", task)?;
        map.serialize_entry("prompt", &self.prompt)?;
        map.serialize_entry("layout", &self.layout)?;
        map.serialize_entry("episode", episode)?;
        map.serialize_entry("seed", base_seed)?;
        map.serialize_entry("split", split)?;
        map.serialize_entry("policy", &self.policy)?;
        if self.privileged {
            map.serialize_entry("privileged", &true)?;
        }
        map.serialize_entry("asset", &self.asset)?;
        map.serialize_entry("soft", &self.soft)?;
        if let Some(variation) = &self.variation {
            map.serialize_entry("variation", variation)?;
        }
        if let Some(origin) = &self.origin {
            map.serialize_entry("origin", origin)?;
        }
        map.end()
    }
}

/// Demonstration of another simulator or robot, of which an episode takes the initial state and the actions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Name of its file, without folders.
    pub file: String,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
    /// Name of the demonstration in the file.
    pub demo: String,
    /// Format of the file.
    pub layout: String,
    /// Initial state that replaces the one of the layout.
    pub start: InitialState,
}

/// First contact of the robot with an object that is not the target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WrongContact {
    /// Time of the contact, s.
    pub time_s: f64,
    /// Name of the object.
    pub object: String,
}

/// Deformation of a soft body that is not the target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OtherDeformation {
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
    /// Peak mass-weighted D of the target, %.
    pub d_peak_weighted: Option<f64>,
    /// Peak of the largest node displacement of the target, %.
    pub d_peak_max: Option<f64>,
    /// Mean D of the target over all physics steps, %.
    #[serde(default)]
    pub d_mean: Option<f64>,
    /// D of the target at the last physics step, %.
    #[serde(default)]
    pub d_final: Option<f64>,
    /// 95th percentile of the target's D over all physics steps, %.
    #[serde(default)]
    pub d_p95: Option<f64>,
    /// Time for which the target's D exceeded τ, s; null without a limit.
    #[serde(default)]
    pub time_over_tau_s: Option<f64>,
    /// Peak D over the other soft bodies, the object at the goal included, %.
    pub d_peak_other: Option<f64>,
    /// The other soft bodies, one by one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<OtherDeformation>,
    /// No other soft body exceeded its own τ; null where that is unknown.
    #[serde(default)]
    pub others_ok: Option<bool>,
    /// First contact of the robot with a movable object that is not the target; null without one.
    #[serde(default)]
    pub first_wrong_contact: Option<WrongContact>,
    /// Stage at which an episode without Goal Success ended; null with it.
    #[serde(default)]
    pub failed_stage: Option<Stage>,
    /// Largest share of the target's volume that was beyond the collapse strain of its material at one time, %; null
    /// for a rigid target and for a material without that strain.
    #[serde(default)]
    pub collapsed_volume_pct: Option<f64>,
    /// Share of the target's volume that was ever beyond the damage strain of its material, %; null as above.
    #[serde(default)]
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
    #[serde(default)]
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
    /// Goal Success with contact of both pads throughout the carry; null in runs of earlier versions.
    #[serde(default)]
    pub contact_success: Option<bool>,
    /// Contact success with Safety Success and NoSlip; null in runs of earlier versions.
    #[serde(default)]
    pub contact_safety: Option<bool>,
    /// Largest normal force on one pad, N.
    pub peak_pad_force_n: f64,
    /// Mean normal force per pad while both pads touched, N.
    pub mean_pad_force_n: f64,
    /// Least force per pad that holds the target on its path ([`super::grip`]), N; null if it was not carried.
    #[serde(default)]
    pub least_pad_force_n: Option<f64>,
    /// Largest force on one pad over the least force; null if the target was not carried.
    #[serde(default)]
    pub grip_ratio: Option<f64>,
    /// Goal Success with a grip ratio of at most `criteria.gentle_ratio`; null in runs of earlier versions.
    #[serde(default)]
    pub gentle: Option<bool>,
}

/// A command that is out of reach of one step of the inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FarCommand {
    /// Commanded position of the tool in the base frame, m.
    pub position_m: [f64; 3],
    /// Distance from the tool, m.
    pub distance_m: f64,
    /// Angle from the orientation of the tool, rad.
    pub angle_rad: f64,
}

impl fmt::Display for FarCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let short = |x: f64| decimal(Some(x), 3).trim_end_matches('0').trim_end_matches('.').to_owned();
        let position = self.position_m.map(short).join(", ");
        let (distance, angle) = (short(self.distance_m), short(self.angle_rad));
        write!(f, "({position}) m, {distance} m and {angle} rad from the tool")
    }
}

/// Counters of the rollout.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RolloutStats {
    /// Number of control steps.
    pub steps: u32,
    /// Simulated time since the policy took over, s.
    pub time_s: f64,
    /// Smallest det F over all Gauss points of the target and all steps; null for a rigid one.
    pub min_det_f: Option<f64>,
    /// Mean Newton iterations per physics step.
    pub newton_mean: f64,
    /// Largest number of Newton iterations in one physics step.
    pub newton_max: u32,
    /// True if the policy saw the true forces at the pads, which no real sensor gives.
    #[serde(default)]
    pub force_observed: bool,
    /// Number of observations with an image of a camera that was inside an object; it shows the
    /// scene beyond that object.
    #[serde(default)]
    pub camera_inside: u32,
    /// Number of control steps whose command was farther from the tool than one step of the inverse kinematics
    /// reaches (0.2 m, 0.6 rad): out of reach, or in the wrong frame or unit.
    #[serde(default)]
    pub far_commands: u32,
    /// The first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_far_command: Option<FarCommand>,
    /// Number of control steps whose grip value was outside of its range by more than a tenth of it, and was clamped.
    #[serde(default)]
    pub clamped_grips: u32,
    /// Reason given by the controller for aborting the episode, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gave_up: Option<String>,
    /// Numbers noted by the controller, such as the grip that an expert chose.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub notes: BTreeMap<String, f64>,
    /// SHA-256 of the actions, as the float64 numbers of their file (little-endian), hexadecimal; absent in runs of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub actions_sha256: Option<String>,
    /// Hash of the final state, hexadecimal.
    pub state_hash: String,
}

impl RolloutStats {
    /// What of the commands was not executed as given, one phrase each.
    pub fn command_notes(&self) -> Vec<String> {
        let first = self.first_far_command.map_or(String::new(), |first| format!(", first: {first}"));
        let far = (self.far_commands > 0)
            .then(|| format!("{} of {} commands were out of reach{first}", self.far_commands, self.steps));
        let clamped = (self.clamped_grips > 0)
            .then(|| format!("{} of {} grip values were out of range", self.clamped_grips, self.steps));
        far.into_iter().chain(clamped).collect()
    }
}

/// One episode. Fields keep their order, and numbers every bit, through JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRecord {
    /// Id, task, target and policy.
    #[serde(flatten)]
    pub header: EpisodeHeader,
    /// End of the rollout.
    pub outcome: Outcome,
    /// Judgement of the episode.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// Counters of the rollout.
    #[serde(flatten)]
    pub stats: RolloutStats,
}

impl EpisodeRecord {
    /// True if the episode counts in DSR: Goal Success with D_peak ≤ τ. Drops do not enter.
    pub fn is_deformation_safe(&self) -> bool {
        self.outcome.is_valid() && self.verdict.goal && self.verdict.deformation_ok == Some(true)
    }

    /// True if the deformation of the target can be judged. An invalid episode with a limit is judged: it fails.
    pub fn is_deformation_judged(&self) -> bool {
        match self.outcome.is_valid() {
            true => self.verdict.deformation_ok.is_some(),
            false => self.verdict.tau.is_some(),
        }
    }

    /// Removes the fields that records of version 0.1 lack, for the comparison with such a record.
    pub fn remove_new_fields(&mut self) {
        self.stats.actions_sha256 = None;
        (self.stats.first_far_command, self.stats.clamped_grips) = (None, 0);
        let v = &mut self.verdict;
        (v.d_mean, v.d_final, v.d_p95, v.time_over_tau_s) = (None, None, None, None);
        (v.others_ok, v.first_wrong_contact, v.failed_stage) = (None, None, None);
        (v.collapsed_volume_pct, v.damaged_volume_pct) = (None, None);
        (v.slip_ok, v.contact_success, v.contact_safety) = (None, None, None);
        (v.least_pad_force_n, v.grip_ratio, v.gentle) = (None, None, None);
        v.others.clear();
    }

    /// True if harm to other objects was recorded; runs of earlier versions have no such fields.
    pub(crate) fn has_harm(&self) -> bool {
        let v = &self.verdict;
        v.others_ok.is_some()
            || v.failed_stage.is_some()
            || v.d_mean.is_some()
            || v.first_wrong_contact.is_some()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A successful, safe soft episode.
    pub(crate) fn sample() -> EpisodeRecord {
        serde_json::from_str(include_str!("../../tests/data/episode_record.json")).expect("a valid record")
    }

    #[test]
    fn commands_that_were_not_executed_as_given_are_told() {
        let mut stats = sample().stats;
        assert!(stats.command_notes().is_empty());
        (stats.far_commands, stats.clamped_grips) = (168, 3);
        stats.first_far_command =
            Some(FarCommand { position_m: [467.0, 4.25, -260.0], distance_m: 534.5104, angle_rad: 0.0 });
        let far = "168 of 168 commands were out of reach, first: (467, 4.25, -260) m, 534.51 m and 0 rad from the tool";
        assert_eq!(stats.command_notes(), [far, "3 of 168 grip values were out of range"]);
    }

    #[test]
    fn a_record_is_one_line_and_comes_back_bit_for_bit() {
        let mut record = sample();
        record.verdict.d_peak_weighted = Some(0.1 + 0.2);
        record.outcome = Outcome::Invalid { reason: "inverted".into(), step: 77, node: None };
        let line = serde_json::to_string(&record).unwrap();
        assert!(!line.contains('\n'));
        assert!(line.starts_with(r#"{"suite":"suite","task":0,"prompt":"#), "{line}");
        assert!(line.contains(r#""outcome":{"kind":"invalid","reason":"inverted","step":77,"node":null}"#));
        assert!(line.ends_with(r#""state_hash":"00ff"}"#));
        let back: EpisodeRecord = serde_json::from_str(&line).unwrap();
        assert_eq!(back, record);
        assert_eq!(serde_json::to_string(&back).unwrap(), line);
    }
}
