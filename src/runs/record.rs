//! Record of one episode: one line of `episodes.jsonl`.
//!
//! [`EpisodeRecord`] flattens four parts into one JSON object: the [`EpisodeHeader`] with its id, its [`Outcome`], the
//! [`Verdict`] of the judge and the [`RolloutStats`]. [`super::record_line`] writes and reads a line with its digest.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize, Serializer, de::DeserializeOwned, ser::SerializeMap};
use serde_json::json;

use softvt_common::{
    episode_id::{EpisodeId, EpisodeSplit},
    text::decimal,
};
use softvt_evaluation::{
    category::{CRUSHED_PCT, EpisodeCategory},
    safety::{and_known, round_to_six_decimals},
    verdict::{Outcome, TargetVerdict, Verdict},
};
use softvt_scene::{InitialStateOverride, SceneVariation};

/// The built-in policies with access to ground-truth state. Whatever has one of these names is marked as they are.
pub const PRIVILEGED_POLICIES: [&str; 11] = [
    "expert",
    "expert-binary",
    "tactile-servo",
    "fixed-closure",
    "size-seen",
    "contact-depth",
    "one-force",
    "one-force-for-all",
    "drives",
    "look-retry",
    "weigh",
];

/// Id, task, target and policy of an episode: the first columns of its record.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct EpisodeHeader {
    #[serde(flatten)]
    pub id: EpisodeId,
    pub prompt: String,
    /// Prompt of the task, where each episode has a prompt of its own.
    #[serde(default)]
    pub task_prompt: Option<String>,
    pub layout: String,
    pub policy: String,
    /// True if the policy sees the true state, as experts do.
    #[serde(default)]
    pub privileged: bool,
    /// True if the actions are those of a recorded run.
    #[serde(default)]
    pub replayed: bool,
    pub asset: String,
    /// True if the target is a soft body.
    pub soft: bool,
    /// Changes of the scene by the variation of the suite, if it varies. The policy does not see them.
    pub variation: Option<Box<SceneVariation>>,
    /// Foreign demonstration that the episode re-executes, if any.
    pub origin: Option<Box<DemonstrationOrigin>>,
}

impl EpisodeHeader {
    /// True if the policy sees the true state, by its record or its name.
    pub fn is_privileged(&self) -> bool {
        self.privileged || PRIVILEGED_POLICIES.contains(&self.policy.as_str())
    }

    /// Prompt of the task, which names it in results.
    pub fn task_prompt(&self) -> &str {
        self.task_prompt.as_ref().unwrap_or(&self.prompt)
    }
}

impl Serialize for EpisodeHeader {
    /// Writes the keys in the order of the result files, in which those of the id are not adjacent.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let EpisodeId { suite, task, episode, base_seed, split } = &self.id;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("suite", suite)?;
        map.serialize_entry("task", task)?;
        map.serialize_entry("prompt", &self.prompt)?;
        if let Some(prompt) = &self.task_prompt {
            map.serialize_entry("task_prompt", prompt)?;
        }
        map.serialize_entry("layout", &self.layout)?;
        map.serialize_entry("episode", episode)?;
        map.serialize_entry("seed", base_seed)?;
        map.serialize_entry("split", split)?;
        map.serialize_entry("policy", &self.policy)?;
        if self.privileged {
            map.serialize_entry("privileged", &true)?;
        }
        if self.replayed {
            map.serialize_entry("replayed", &true)?;
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
pub struct DemonstrationOrigin {
    pub file: String,
    pub sha256: String,
    pub demo: String,
    pub format: String,
    /// Initial state that replaces the one of the layout.
    pub start: InitialStateOverride,
}

/// A command that is out of reach of one step of the inverse kinematics, or outside of the joints' limits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnreachableCommand {
    /// Commanded position of the tool in the base frame, m.
    pub position_m: [f64; 3],
    /// Distance from the tool, m.
    pub distance_m: f64,
    /// Angle from the orientation of the tool, rad.
    pub angle_rad: f64,
    /// The first commanded joint position that is outside of its limits, if one is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<JointOutsideLimits>,
}

/// A commanded joint position outside of the limits of its joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointOutsideLimits {
    /// Number of the joint, from 1 at the base.
    pub number: u8,
    pub position_rad: f64,
    pub lower_rad: f64,
    pub upper_rad: f64,
}

impl fmt::Display for UnreachableCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let short = |x: f64| decimal(Some(x), 3).trim_end_matches('0').trim_end_matches('.').to_owned();
        let position = self.position_m.map(short).join(", ");
        let (distance, angle) = (short(self.distance_m), short(self.angle_rad));
        if let Some(JointOutsideLimits { number, position_rad, lower_rad, upper_rad }) = self.joint {
            let [at, lower, upper] = [position_rad, lower_rad, upper_rad].map(short);
            return write!(f, "joint {number} at {at} rad, whose limits are {lower} to {upper} rad");
        }
        write!(f, "({position}) m, {distance} m and {angle} rad from the tool")
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RolloutStats {
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
    pub force_observed: bool,
    /// Number of observations with an image of a camera that was inside an object; it shows the
    /// scene beyond that object.
    pub camera_inside: u32,
    /// Number of control steps whose command was farther from the tool than one step of the inverse kinematics reaches
    /// (0.2 m, 0.6 rad), or had a joint position outside of its limits: out of reach, or in the wrong frame or unit.
    pub far_commands: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_far_command: Option<UnreachableCommand>,
    /// Number of control steps whose grip value was outside of its range, and was clamped: for decoded answers of
    /// policies by more than a tenth of the range.
    pub clamped_grips: u32,
    /// Number of control steps whose displacement was beyond −1..=1 by more than a tenth of that
    /// range, and was clamped.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub clamped_steps: u32,
    /// Number of attempts at the episode, of a policy outside of softvt that ended earlier ones or was interrupted;
    /// absent for the usual one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attempts: Option<u32>,
    /// Reason given by the controller for aborting the episode, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gave_up: Option<String>,
    /// Numbers noted by the controller, such as the grip that an expert chose.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub notes: BTreeMap<String, f64>,
    /// Metrics of the suite, by name; null for those without a value.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub metrics: BTreeMap<String, Option<f64>>,
    /// SHA-256 of the actions, as the float64 numbers of their file (little-endian), hexadecimal.
    pub actions_sha256: String,
    pub state_hash: String,
}

/// True for the count of what did not happen, which records leave out.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_zero(count: &u32) -> bool {
    *count == 0
}

impl RolloutStats {
    /// Commands that were not executed as given, one phrase per reason.
    pub fn command_notes(&self) -> Vec<String> {
        let first = self.first_far_command.map_or(String::new(), |first| format!(", first: {first}"));
        let far = (self.far_commands > 0)
            .then(|| format!("{} of {} commands were out of reach{first}", self.far_commands, self.steps));
        let clamped = (self.clamped_grips > 0)
            .then(|| format!("{} of {} grip values were out of range", self.clamped_grips, self.steps));
        let steps = (self.clamped_steps > 0)
            .then(|| format!("{} of {} displacements were beyond −1..1", self.clamped_steps, self.steps));
        far.into_iter().chain(clamped).chain(steps).collect()
    }
}

/// One episode. Fields keep their order, and numbers every bit, through JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRecord {
    #[serde(flatten)]
    pub header: EpisodeHeader,
    pub outcome: Outcome,
    #[serde(flatten)]
    pub verdict: Verdict,
    #[serde(flatten)]
    pub stats: RolloutStats,
}

/// True for a key that a record has or may have, other than those within its fields.
pub fn is_record_key(name: &str) -> bool {
    /// True if a field of a `T` reads the key: none takes lists of empty lists.
    fn is_read<T: Serialize + DeserializeOwned>(part: &T, name: &str) -> bool {
        let mut part = json!(part);
        part[name] = json!([[[]]]);
        serde_json::from_value::<T>(part).is_err()
    }
    let id =
        EpisodeId { suite: String::new(), task: 0, episode: 0, base_seed: 0, split: EpisodeSplit::default() };
    let header = EpisodeHeader {
        id,
        prompt: String::new(),
        task_prompt: None,
        layout: String::new(),
        policy: String::new(),
        privileged: false,
        replayed: false,
        asset: String::new(),
        soft: false,
        variation: None,
        origin: None,
    };
    let verdict = Verdict { targets: vec![TargetVerdict::default()], ..Verdict::default() };
    let is_of_verdict = is_read(&verdict, name) && name != "object";
    name == "outcome" || is_read(&header, name) || is_of_verdict || is_read(&RolloutStats::default(), name)
}

impl EpisodeRecord {
    /// The one word for the result of the episode.
    pub fn category(&self) -> EpisodeCategory {
        EpisodeCategory::new(&self.outcome, &self.verdict)
    }

    /// The same in words: of a rigid object *safe* is *placed*.
    pub fn outcome_name(&self) -> &'static str {
        match self.category() {
            EpisodeCategory::Safe if !self.has_soft_target() => "placed",
            category => category.name(),
        }
    }

    /// The same with harm that the name does not tell: "dropped, over the limit", "over the limit, crushed".
    pub fn result_and_harm(&self) -> String {
        let is_over = self.is_within_limits() == Some(false);
        let harm = match self.crushed_volume_pct() {
            Some(_) => ", crushed",
            None if is_over && self.category() != EpisodeCategory::OverLimit => ", over the limit",
            None => "",
        };
        format!("{}{harm}", self.outcome_name())
    }

    /// The parts of a missed goal that did not hold at the end: "not bowl on plate".
    pub fn missed_parts(&self) -> Vec<String> {
        let missed = self.verdict.goal_parts.iter().filter(|part| part.holds == part.negated);
        let words = missed.filter(|_| !self.verdict.goal).map(|part| match part.negated {
            true => format!("{}, which must not be", part.name),
            false => format!("not {}", part.name),
        });
        words.collect()
    }

    /// The objects that the goal moves and that deform, the object of the task first.
    pub fn soft_targets(&self) -> impl Iterator<Item = &TargetVerdict> {
        self.verdict.soft_targets()
    }

    /// True if an object that the goal moves is soft.
    pub fn has_soft_target(&self) -> bool {
        self.soft_targets().next().is_some()
    }

    /// True if an object that the goal moves is soft, and the deformation of each such object can be judged.
    pub fn has_judged_soft_target(&self) -> bool {
        self.has_soft_target() && self.is_deformation_judged()
    }

    /// True if D stayed within the limit of each soft object that the goal moves, false if one is known to exceed its
    /// own; `None` where neither is known.
    pub fn is_within_limits(&self) -> Option<bool> {
        self.soft_targets().map(|target| target.deformation_ok).fold(Some(true), and_known)
    }

    /// True if D stayed within κ·D_ref of each soft object that the goal moves; false where that is unknown.
    pub fn is_within_at(&self, kappa: f64) -> bool {
        self.outcome.is_valid() && self.verdict.is_within(Some(kappa)) == Some(true)
    }

    /// Safety Success with κ·D_ref as the limit of each soft object that the goal moves.
    pub fn is_safe_at(&self, kappa: f64) -> bool {
        self.outcome.is_valid() && self.verdict.is_safe(Some(kappa))
    }

    /// The smallest κ at which the episode [is safe](Self::is_safe_at); `None` without one.
    pub fn safe_from(&self) -> Option<f64> {
        let mut kappas = self.soft_targets().map(|target| Some(smallest_tau(target.d_peak?) / target.d_ref?));
        let kappa = kappas.try_fold(0.0, |largest: f64, kappa| Some(largest.max(kappa?)))?;
        self.is_safe_at(kappa).then_some(kappa)
    }

    /// True if a soft object that the goal moves has no limit.
    pub fn lacks_limit(&self) -> bool {
        self.soft_targets().any(|target| target.tau.is_none())
    }

    /// The largest of a quantity over the objects that the goal moves.
    fn largest(&self, of: fn(&TargetVerdict) -> Option<f64>) -> Option<f64> {
        self.verdict.largest_by(of).and_then(of)
    }

    /// Largest peak D of an object that the goal moves, % of its diagonal.
    pub fn d_peak(&self) -> Option<f64> {
        self.largest(|target| target.d_peak)
    }

    /// Largest peak D over τ of an object that the goal moves, of a valid episode.
    pub fn d_over_tau(&self) -> Option<f64> {
        self.largest(TargetVerdict::ratio).filter(|_| self.outcome.is_valid())
    }

    /// The largest peak D in words: "D 3.00 % of roll = 6.00 × limit". `None` if nothing was measured.
    pub fn deformation_in_words(&self) -> Option<String> {
        let Some(target) = self.verdict.most_deformed() else {
            return self.d_peak().map(|d| format!("D {d:.2} %"));
        };
        let of = target.object.as_ref().map(|object| format!(" of {object}")).unwrap_or_default();
        Some(format!("D {} %{of} = {} × limit", decimal(target.d_peak, 2), decimal(target.ratio(), 2)))
    }

    /// Longest time for which D of an object that the goal moves exceeded its τ, s.
    pub fn time_over_tau_s(&self) -> Option<f64> {
        self.largest(|target| target.time_over_tau_s)
    }

    /// Largest share of the volume of an object that the goal moves that collapsed, %.
    pub fn collapsed_volume_pct(&self) -> Option<f64> {
        self.largest(|target| target.collapsed_volume_pct)
    }

    /// Largest share of the volume of an object that the goal moves that was damaged, %.
    pub fn damaged_volume_pct(&self) -> Option<f64> {
        self.largest(|target| target.damaged_volume_pct)
    }

    /// [`collapsed_volume_pct`](Self::collapsed_volume_pct), if it is large enough for the object to be called crushed.
    pub fn crushed_volume_pct(&self) -> Option<f64> {
        self.collapsed_volume_pct().filter(|pct| *pct >= CRUSHED_PCT)
    }

    /// True if the object was crushed in an episode of the category "over the limit".
    pub fn is_crushed_over_limit(&self) -> bool {
        self.category() == EpisodeCategory::OverLimit && self.crushed_volume_pct().is_some()
    }

    /// A metric of the suite; `None` without a value.
    pub fn metric(&self, name: &str) -> Option<f64> {
        self.stats.metrics.get(name).copied().flatten()
    }

    /// True if the episode counts in DSR: Goal Success with D_peak ≤ τ of each target. Drops do not enter.
    pub fn is_deformation_safe(&self) -> bool {
        self.outcome.is_valid() && self.verdict.goal && self.is_within_limits() == Some(true)
    }

    /// True if the deformation of each soft target can be judged. An invalid episode with limits is judged: it fails.
    pub fn is_deformation_judged(&self) -> bool {
        let is_valid = self.outcome.is_valid();
        self.soft_targets().all(|target| match is_valid {
            true => target.deformation_ok.is_some(),
            false => target.tau.is_some(),
        })
    }
}

/// The smallest τ that admits a peak of `d_pct`, %; a τ has six decimals.
fn smallest_tau(d_pct: f64) -> f64 {
    let tau = round_to_six_decimals(d_pct);
    if tau < d_pct { round_to_six_decimals(tau + 1e-6) } else { tau }
}

#[cfg(test)]
pub(crate) mod tests {
    use softvt_evaluation::verdict::InvalidReason;

    use super::*;

    /// A successful, safe soft episode.
    pub(crate) fn sample() -> EpisodeRecord {
        serde_json::from_str(include_str!("../../tests/data/episode_record.json")).expect("a valid record")
    }

    #[test]
    fn deformation_is_judged_of_every_soft_object_of_the_goal() {
        let mut record = sample();
        let other = TargetVerdict {
            object: Some("roll".to_owned()),
            soft: true,
            d_peak: Some(3.0),
            collapsed_volume_pct: Some(60.0),
            tau: Some(0.5),
            deformation_ok: Some(false),
            ..TargetVerdict::default()
        };
        assert_eq!((record.is_within_limits(), record.crushed_volume_pct()), (Some(true), None));
        record.verdict.targets.push(other);
        assert_eq!((record.is_within_limits(), record.crushed_volume_pct()), (Some(false), Some(60.0)));
        assert_eq!(record.deformation_in_words().unwrap(), "D 3.00 % of roll = 6.00 × limit");
        record.verdict.targets[1].deformation_ok = None;
        assert_eq!((record.is_within_limits(), record.is_deformation_judged()), (None, false));
        let rigid = TargetVerdict { object: Some("can".to_owned()), ..TargetVerdict::default() };
        record.verdict.targets[1] = rigid;
        assert!(record.is_deformation_judged() && record.verdict.most_deformed().unwrap().object.is_none());
        // The other way round: a rigid object of the task, and a soft one that the goal moves too.
        record.verdict.object_mut().soft = false;
        assert!(!record.has_soft_target());
        record.verdict.targets[1].soft = true;
        assert!(record.has_soft_target());
    }

    #[test]
    fn every_episode_has_one_category() {
        let category = |change: fn(&mut EpisodeRecord)| {
            let mut record = sample();
            change(&mut record);
            record.category()
        };
        let over = |r: &mut EpisodeRecord| {
            (r.verdict.safety, r.verdict.object_mut().deformation_ok) = (false, Some(false));
        };
        assert_eq!(category(|_| ()), EpisodeCategory::Safe);
        assert_eq!(category(over), EpisodeCategory::OverLimit);
        let dropped_at_goal = |r: &mut EpisodeRecord| (r.verdict.safety, r.verdict.no_drop) = (false, false);
        assert_eq!(category(dropped_at_goal), EpisodeCategory::Dropped);
        let missed = |r: &mut EpisodeRecord| {
            (r.verdict.safety, r.verdict.object_mut().deformation_ok) = (false, Some(false));
            r.verdict.goal = false;
        };
        assert_eq!(
            category(missed),
            EpisodeCategory::GoalMissed,
            "the limit counts where the goal is reached"
        );
        assert_eq!(
            category(|r| (r.verdict.safety, r.verdict.slip_ok) = (false, Some(false))),
            EpisodeCategory::Slipped
        );
        assert_eq!(
            category(|r| (r.verdict.safety, r.verdict.object_mut().deformation_ok) = (false, None)),
            EpisodeCategory::NotJudged
        );
        assert_eq!(
            category(|r| r.outcome = Outcome::Error { message: String::new() }),
            EpisodeCategory::Invalid
        );
        let glyphs = EpisodeCategory::ALL.map(EpisodeCategory::glyph);
        assert!(glyphs.iter().enumerate().all(|(at, glyph)| !glyphs[..at].contains(glyph)));
    }

    #[test]
    fn every_key_of_a_record_and_no_other_is_one() {
        let written = serde_json::to_value(sample()).unwrap();
        let absent =
            ["task_prompt", "targets", "goal_parts", "others", "gave_up", "variation", "clamped_steps"];
        for key in written.as_object().unwrap().keys().map(String::as_str).chain(absent) {
            assert!(is_record_key(key), "{key}");
        }
        for other in ["object", "reason", "slip", "d_over_tau", "weight"] {
            assert!(!is_record_key(other), "{other}");
        }
    }

    #[test]
    fn a_record_is_one_line_and_comes_back_bit_for_bit() {
        let mut record = sample();
        record.verdict.object_mut().d_peak_v1 = Some(0.1 + 0.2);
        record.outcome = Outcome::Invalid { reason: InvalidReason::Inverted, step: 77, node: None };
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
