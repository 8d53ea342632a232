//! Files with SoftVTBench's names and units, for its released scorer.
//!
//! D and τ are those of SoftVTBench's definition ([`V1_METRIC_ID`]). Its `safe_success` ignores NoDrop; softvt's is in
//! `summary.json` of the run folder. The scorer treats every
//! `policy_action_debug.jsonl` as one episode, hence one folder per episode.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::record::{EpisodeHeader, EpisodeRecord};
use softvt_common::{
    episode_id::{EpisodeId, EpisodeIndex},
    files::{self, FileError, replace},
    text::csv_field,
};
use softvt_evaluation::{
    deformation::{ReferenceShape, V1_METRIC_ID},
    statistics::{Rate, quantile},
    thresholds::ThresholdFile,
};
use softvt_geometry::Vec3;

pub const FOLDER: &str = "softvtbench";
/// One row per episode.
const EPISODES_CSV: &str = "episodes.csv";
/// Rates, %.
const SUMMARY_JSON: &str = "summary.json";
/// τ by asset, % of the bounding-box diagonal.
pub const THRESHOLDS_JSON: &str = "thresholds.json";

/// One control step of `policy_action_debug.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DebugFrame {
    /// Control step, from 0.
    pub frame: u32,
    /// Episode index in the task.
    pub exp_idx: u32,
    pub task_suite: String,
    pub task_id: usize,
    /// True once the goal has held for the required time.
    pub success_now: bool,
    #[serde(flatten)]
    pub shape: DebugShape,
}

/// Deformation of the target, with SoftVTBench's field names; % of the bounding-box diagonal, lengths in m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DebugShape {
    pub fem_deformation_known: bool,
    /// [`V1_METRIC_ID`]; null when not known.
    pub fem_deformation_metric_id: Option<String>,
    pub fem_deformation_asset: String,
    pub fem_deformation_nodes: Option<usize>,
    /// Largest D over the physics steps of the control step, so that the peak of the frames is the peak of the rollout.
    pub fem_deformation_rms: Option<f64>,
    /// Largest node displacement at the same physics step.
    pub fem_deformation_max: Option<f64>,
    /// Diagonal of the reference's bounding box.
    pub fem_bbox_diag: Option<f64>,
    /// Distance of the bounding box's extents from the reference's; null if only the peak of D is known.
    pub fem_bbox_delta: Option<f64>,
    /// Extents of the bounding box; null if only the peak of D is known.
    pub fem_bbox_dims: Option<[f64; 3]>,
}

impl DebugShape {
    /// From the reference, the largest D of SoftVTBench's definition in the control step, and the largest displacement
    /// of a node ([`Deformation::max_pct`](softvt_evaluation::deformation::Deformation)) and the bounding box at that
    /// time. D is unknown without a reference or a measurement, as for a rigid target.
    pub fn new(
        asset: &str,
        reference: Option<&ReferenceShape>,
        v1_rms_pct: Option<f64>,
        max_pct: Option<f64>,
        bbox_m: Option<Vec3>,
    ) -> Self {
        let known = reference.filter(|_| v1_rms_pct.is_some());
        Self {
            fem_deformation_known: known.is_some(),
            fem_deformation_metric_id: known.map(|_| V1_METRIC_ID.into()),
            fem_deformation_asset: asset.into(),
            fem_deformation_nodes: known.map(ReferenceShape::node_count),
            fem_deformation_rms: known.and(v1_rms_pct),
            fem_deformation_max: known
                .zip(max_pct)
                .map(|(reference, max)| max * reference.diagonal_m() / reference.v1_diagonal_m()),
            fem_bbox_diag: known.map(ReferenceShape::v1_diagonal_m),
            fem_bbox_delta: known.zip(bbox_m).map(|(reference, bbox)| (bbox - reference.bbox_m()).norm()),
            fem_bbox_dims: known.and(bbox_m).map(Into::into),
        }
    }
}

impl DebugFrame {
    /// The entry of a control step of an episode.
    pub fn new(id: &EpisodeId, frame: u32, success_now: bool, shape: DebugShape) -> Self {
        Self {
            frame,
            exp_idx: id.episode,
            task_suite: id.suite.clone(),
            task_id: id.task,
            success_now,
            shape,
        }
    }
}

/// Path of an episode's `policy_action_debug.jsonl` in the run folder `dir`.
pub fn debug_log_path(dir: &Path, index: EpisodeIndex) -> PathBuf {
    let EpisodeIndex { task, episode } = index;
    // Zero-padded, since the scorer sorts paths.
    dir.join(FOLDER).join(format!("task_{task:03}/episode_{episode:05}/policy_action_debug.jsonl"))
}

/// Writes an episode's `policy_action_debug.jsonl` to `path`.
pub fn write_debug_log(path: &Path, header: &EpisodeHeader, frames: &[DebugFrame]) -> Result<(), FileError> {
    // The row of an episode that ended before its first control step: the scorer ignores episodes without rows.
    let unknown = || DebugShape::new(&header.asset, None, None, None, None);
    let placeholder = frames.is_empty().then(|| DebugFrame::new(&header.id, 0, false, unknown()));
    files::write_json_lines(path, frames.iter().chain(&placeholder))
}

/// True if all files of [`write_scores`] exist.
pub fn has_scores(dir: &Path) -> bool {
    [EPISODES_CSV, SUMMARY_JSON, THRESHOLDS_JSON].iter().all(|name| dir.join(FOLDER).join(name).is_file())
}

/// Writes `episodes.csv`, `summary.json` and `thresholds.json` of one suite's `records` below the run folder `dir`. The
/// thresholds are those on SoftVTBench's D ([`ThresholdFile::released`]).
pub fn write_scores(
    dir: &Path,
    records: &[EpisodeRecord],
    thresholds: &ThresholdFile,
) -> Result<(), FileError> {
    let folder = dir.join(FOLDER);
    let scored: Vec<ScoredEpisode> =
        in_order(records).into_iter().map(|r| ScoredEpisode::new(r, thresholds)).collect();
    replace(&folder.join(EPISODES_CSV), episodes_csv(&scored))?;
    files::write_json(&folder.join(SUMMARY_JSON), &summary(&scored))?;
    replace(&folder.join(THRESHOLDS_JSON), thresholds.to_text())
}

/// An episode with the limit of SoftVTBench's D: one per asset, and none where softvt knows none.
struct ScoredEpisode<'a> {
    record: &'a EpisodeRecord,
    tau: Option<f64>,
}

impl<'a> ScoredEpisode<'a> {
    fn new(record: &'a EpisodeRecord, thresholds: &ThresholdFile) -> Self {
        let limit = thresholds.limit(&record.header.asset).filter(|_| record.verdict.object().tau.is_some());
        Self { record, tau: limit.map(|limit| limit.tau_pct()) }
    }

    fn peak_pct(&self) -> Option<f64> {
        self.record.verdict.object().d_peak_v1
    }

    /// SoftVTBench's Safe Success: Goal ∧ D_peak ≤ τ, without NoDrop; `None` if evidence is missing.
    fn safe_success(&self) -> Option<bool> {
        match (self.record.verdict.goal, self.record.verdict.object().soft) {
            (false, _) => Some(false),
            (true, false) => Some(true),
            (true, true) => self.deform_ok(),
        }
    }

    fn is_safe(&self) -> bool {
        self.safe_success() == Some(true)
    }

    fn deform_ok(&self) -> Option<bool> {
        self.peak_pct().zip(self.tau).map(|(d, tau)| d <= tau)
    }

    /// Reasons for which the scorer cannot judge the episode, in its terms.
    fn missing_evidence(&self) -> String {
        let mut reasons = Vec::new();
        if self.peak_pct().is_none() {
            reasons.push("missing_fem_deformation_rms".to_owned());
            reasons.push("missing_fem_deformation_metric_id".to_owned());
        }
        if self.tau.is_none() {
            reasons.push(format!("missing_tau:{}", self.record.header.asset));
        }
        reasons.join(";")
    }
}

fn episodes_csv(episodes: &[ScoredEpisode<'_>]) -> String {
    let mut out = String::from(
        "source,task,episode,asset,goal_success,d_peak,tau,deform_ok,safe_success,frames,reason\r\n",
    );
    let truth = |value: Option<bool>| match value {
        Some(true) => "True",
        Some(false) => "False",
        None => "",
    };
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.6}"));
    for episode in episodes {
        let header = &episode.record.header;
        // Writing to a String cannot fail.
        let _ = write!(
            out,
            "jsonl,{},{},{},{},{},{},{},{},{},{}\r\n",
            header.id.task,
            header.id.episode,
            csv_field(&header.asset),
            truth(Some(episode.record.verdict.goal)),
            number(episode.peak_pct()),
            number(episode.tau),
            truth(episode.deform_ok()),
            truth(episode.safe_success()),
            episode.record.stats.steps.max(1),
            csv_field(&episode.missing_evidence()),
        );
    }
    out
}

fn summary(episodes: &[ScoredEpisode<'_>]) -> Value {
    let n = episodes.len();
    let goal_rate = Rate::from_test(episodes, |e| e.record.verdict.goal).rate;
    let safe_rate = Rate::from_test(episodes, ScoredEpisode::is_safe).rate;
    let mut by_asset = serde_json::Map::new();
    for asset in episodes.iter().map(|e| &e.record.header.asset) {
        if !by_asset.contains_key(asset) {
            let group: Vec<_> = episodes.iter().filter(|e| e.record.header.asset == *asset).collect();
            by_asset.insert(asset.clone(), asset_summary(&group));
        }
    }
    let mut scores = json!({
        "n_episodes": n,
        "n_goal_known": n,
        "n_safe_unknown": episodes.iter().filter(|e| e.safe_success().is_none()).count(),
        "goal_success_rate": goal_rate,
        "safe_success_rate": safe_rate,
        "goal_safe_gap": goal_rate.zip(safe_rate).map(|(goal, safe)| round_to(goal - safe, 2)),
        "rigid_mode": n > 0 && episodes.iter().all(|e| !e.record.verdict.object().soft),
        "deformation_metric_id": V1_METRIC_ID,
        "by_asset": by_asset,
    });
    // Not a field of SoftVTBench, hence only written for privileged policies.
    if episodes.iter().any(|e| e.record.header.privileged) {
        scores["privileged"] = json!(true);
    }
    scores
}

fn asset_summary(group: &[&ScoredEpisode<'_>]) -> Value {
    let goal = group.iter().filter(|e| e.record.verdict.goal).count();
    let safe = group.iter().filter(|e| e.is_safe()).count();
    let mut peaks: Vec<f64> = group.iter().filter_map(|e| e.peak_pct()).collect();
    peaks.sort_by(f64::total_cmp);
    json!({
        "n": group.len(),
        "goal": goal,
        "safe": safe,
        "tau": group.first().and_then(|e| e.tau),
        "d_peak_p50": quantile(&peaks, 0.5).map(|d| round_to(d, 4)),
        "d_peak_max": peaks.last().map(|d| round_to(*d, 4)),
        "goal_success_rate": Rate::new(goal, group.len()).rate,
        "safe_success_rate": Rate::new(safe, group.len()).rate,
    })
}

fn in_order(records: &[EpisodeRecord]) -> Vec<&EpisodeRecord> {
    let mut sorted: Vec<_> = records.iter().collect();
    sorted.sort_by_key(|r| r.header.id.index());
    sorted
}

fn round_to(value: f64, digits: i32) -> f64 {
    let scale = 10.0_f64.powi(digits);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests;
