//! The record of one episode: one line of `episodes.jsonl`.

use serde::{Deserialize, Serialize};

use super::judge::Verdict;
use crate::scene::InitialState;

/// How a rollout ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Outcome {
    /// The goal held for long enough.
    Completed,
    /// The budget was spent.
    Timeout,
    /// The physics could not be trusted any more.
    Invalid {
        /// Why: "inverted", "not_finite", "not_converged", "too_fast", "too_hard" …
        reason: String,
        /// Physics step since the policy took over.
        step: u64,
        /// The node it was seen at, where there is one.
        node: Option<u32>,
    },
    /// The episode could not be run to its end.
    Error {
        /// What went wrong.
        message: String,
    },
}

impl Outcome {
    /// Whether the rollout's evidence can be judged.
    pub fn is_valid(&self) -> bool {
        matches!(self, Self::Completed | Self::Timeout)
    }
}

/// Which episode this is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Suite name.
    pub suite: String,
    /// Task index in the suite.
    pub task: usize,
    /// What the policy was told.
    pub prompt: String,
    /// Layout name.
    pub layout: String,
    /// Episode index in the task.
    pub episode: u32,
    /// Base seed.
    pub seed: u64,
    /// Split: "eval", "demo" …
    pub split: String,
    /// Policy name.
    pub policy: String,
    /// Whether it sees the true state, as experts do.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub privileged: bool,
    /// Asset of the target.
    pub asset: String,
    /// Whether the target deforms.
    pub soft: bool,
    /// Which foreign demonstration it re-executes, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Box<Origin>>,
}

/// A demonstration that was made in another world, of which an episode takes its start and its actions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Its file, without the folders above.
    pub file: String,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
    /// Name of the demonstration in the file.
    pub demo: String,
    /// How the file is laid out.
    pub layout: String,
    /// What the episode starts from instead of what its layout made.
    pub start: InitialState,
}

/// What the run itself counted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RolloutStats {
    /// Control steps.
    pub steps: u32,
    /// Simulated time since the policy took over, s.
    pub time_s: f64,
    /// Smallest det F of any Gauss point of the target at any step; null for a rigid one.
    pub min_det_f: Option<f64>,
    /// Mean Newton iterations a physics step.
    pub newton_mean: f64,
    /// Most Newton iterations in one physics step.
    pub newton_max: u32,
    /// Whether the policy saw the true forces at the pads, which no real sensor gives.
    #[serde(default)]
    pub force_observed: bool,
    /// Observations with a picture of a camera that stood inside of something: it shows what is beyond that thing.
    #[serde(default)]
    pub camera_inside: u32,
    /// Control steps whose command was farther from the tool than a step of the inverse kinematics looks (0.2 m, 0.6 rad):
    /// out of reach, or in the wrong frame or unit.
    #[serde(default)]
    pub far_commands: u32,
    /// Why whoever drove gave up, if it said so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gave_up: Option<String>,
    /// Hash of the final state, hexadecimal.
    pub state_hash: String,
}

/// One episode. Fields keep their order and floats their bits through JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRecord {
    /// Which episode.
    #[serde(flatten)]
    pub identity: Identity,
    /// How it ended.
    pub outcome: Outcome,
    /// What is said of it.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// What was counted.
    #[serde(flatten)]
    pub stats: RolloutStats,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A successful, safe soft episode.
    pub(crate) fn sample() -> EpisodeRecord {
        let identity = Identity {
            suite: "suite".into(),
            task: 0,
            prompt: "put it there".into(),
            layout: "layout".into(),
            episode: 0,
            seed: 11,
            split: "eval".into(),
            policy: "expert".into(),
            privileged: false,
            asset: "bun".into(),
            soft: true,
            origin: None,
        };
        let verdict = Verdict {
            goal: true,
            goal_time_s: Some(8.4),
            goal_v1: true,
            no_drop: true,
            drop: None,
            no_slip: true,
            slip_mm: 0.1,
            d_peak: Some(1.0 / 3.0),
            d_peak_weighted: Some(0.3),
            d_peak_max: Some(0.9),
            d_peak_other: Some(0.0),
            wrong_instance: false,
            kappa: Some(0.5),
            tau: Some(1.0),
            d_ref: Some(2.0),
            deformation_ok: Some(true),
            safety: true,
            safety_known: true,
            kappas: Vec::new(),
            missing_evidence: 0,
            missing_deformation: 0,
            peak_pad_force_n: 1.5,
            mean_pad_force_n: 1.2,
        };
        let stats = RolloutStats {
            steps: 168,
            time_s: 8.4,
            min_det_f: Some(0.7),
            newton_mean: 2.1,
            newton_max: 5,
            force_observed: false,
            camera_inside: 0,
            far_commands: 0,
            gave_up: None,
            state_hash: "00ff".into(),
        };
        EpisodeRecord { identity, outcome: Outcome::Completed, verdict, stats }
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
