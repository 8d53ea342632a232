//! Descriptions of an exported dataset: `softvt.json`, and `README.md`.

use serde_json::{Value, json};

use super::{
    ArmControl, ExportJob, ExportSummary,
    features::{self, Content, Feature},
};
use crate::streams::{JOINT_ACTIONS, actions_in};
use softvt_benchmark::CONTROL_HZ;

/// Parts of `README.md` that a format decides.
pub(super) struct FormatText<'a, Key> {
    /// Metadata for Hugging Face's hub: lines of YAML.
    pub hub: &'a str,
    pub name: &'a str,
    /// Key of a feature; `None` for one that the format does not have.
    pub key: Key,
    /// Text after the table: the files of the description.
    pub files: String,
}

/// The content of `softvt.json`: how actions and states are encoded.
pub(super) fn encoding(job: &ExportJob<'_>) -> Value {
    let gripper = job.selection.gripper;
    let grip_stream = actions_in(gripper);
    json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "control": job.config.control.name(),
        "gripper": gripper.name(),
        "source": match job.config.control {
            ArmControl::Pose => grip_stream.to_owned(),
            ArmControl::Joints => format!("{JOINT_ACTIONS}, gripper of {grip_stream}"),
        },
    })
}

/// Features in the order of the table: those that are named here, then the others.
const FIRST: [&str; 4] = ["tactile_image", "tactile_marker_motion", "state", "actions"];

/// The human-readable description, with the metadata that Hugging Face's hub reads.
pub(super) fn readme<Key: Fn(&Feature) -> Option<String>>(
    job: &ExportJob<'_>,
    format: &FormatText<'_, Key>,
) -> String {
    let ExportSummary { episodes, frames, tasks } = job.selection.summary();
    let FormatText { hub, name, key, files } = format;
    let (cameras, mut rows): (Vec<_>, Vec<_>) =
        features::all(job).into_iter().partition(|feature| matches!(feature.content, Content::Image(0 | 1)));
    let cameras: Vec<String> =
        cameras.iter().filter_map(|feature| Some(format!("`{}`", key(feature)?))).collect();
    // Further features in the order in which openpi's data have them, the joint positions last.
    rows.sort_by_key(|feature| {
        let first = FIRST.iter().position(|name| *name == feature.name);
        (first.unwrap_or(FIRST.len()), feature.name == "joint_state")
    });
    let row = |feature: &Feature| Some(format!("| `{}` | {} |\n", key(feature)?, feature.about));
    let rows: String = rows.iter().filter_map(row).collect();
    let safe =
        if job.selection.is_safe { " and is safe by softvt's evaluator" } else { "; some are not safe" };
    let prompts: String = job.selection.prompts.iter().map(|prompt| format!("- {prompt}\n")).collect();
    format!(
        "---\nlicense: apache-2.0\ntask_categories:\n- robotics\n{hub}---\n\
         # Demonstrations of soft-object manipulation, {name}\n\n\
         {episodes} episodes, {frames} frames at {CONTROL_HZ} Hz, {tasks} prompts; exported by softvt {} from a recording in \
         simulation. Every episode reaches its goal{safe}.\n\n\
         Frame t holds the observation of a policy at step t and the action commanded then.\n\n\
         | key | |\n|---|---|\n\
         | {} | third person and wrist |\n{rows}\n\
         {files}\n\n\
         {prompts}",
        env!("CARGO_PKG_VERSION"),
        cameras.join(", "),
    )
}
