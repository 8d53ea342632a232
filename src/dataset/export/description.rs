//! Descriptions of an exported dataset: `softvt.json`, and `README.md`.

use serde_json::{Value, json};

use super::{ArmControl, ExportJob, ExportSummary, selection::IMAGE_FEATURES};
use crate::demonstration::{JOINT_ACTIONS, actions_stream_name};
use softvt_benchmark::CONTROL_HZ;
use softvt_policy::profile::GripCode;

/// What `README.md` says of a format.
pub(super) struct FormatText<'a, Key> {
    /// Metadata for Hugging Face's hub: lines of YAML.
    pub hub: &'a str,
    /// Name and version.
    pub name: &'a str,
    /// Key of a feature, by its name in openpi's data.
    pub key: Key,
    /// Rows of the table of keys that only this format has.
    pub more_keys: &'a str,
    /// Text after the table: the files of the description.
    pub files: String,
}

/// The content of `softvt.json`: how actions and states are encoded.
pub(super) fn encoding(job: &ExportJob<'_>) -> Value {
    let gripper = job.selection.gripper;
    let grip_stream = actions_stream_name(gripper);
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

/// The state of a row, in words.
pub(super) fn state(control: ArmControl) -> String {
    let arm = match control {
        ArmControl::Pose => "tool position (m), axis-angle (rad) in the robot's base frame",
        ArmControl::Joints => "positions of the seven joints of the arm (rad)",
    };
    format!("{arm}; position of one finger, 0 closed to 0.04 m")
}

/// The action of a row, in words.
pub(super) fn action(job: &ExportJob<'_>) -> String {
    let motion = match job.config.control {
        ArmControl::Pose => "absolute tool position and axis-angle",
        ArmControl::Joints => "commanded joint positions (rad)",
    };
    let gripper = match job.selection.gripper {
        GripCode::Continuous => "the commanded closure, 0 open to 1 closed",
        GripCode::Binary => "1 while the gripper is commanded to hold, else 0",
        GripCode::TwoWidth => {
            "closure 0 while open, the median commanded closure of the demonstration while closed"
        }
        GripCode::Force => "grip force in N while closed, -1 while open",
    };
    format!("{motion}; {gripper}")
}

/// Meaning of the mosaic of tactile images.
pub(super) const MOSAIC: &str =
    "4 × 4 cells: the last 8 images of the left finger above, of the right finger below";
/// Meaning of the markers.
pub(super) const MARKERS: &str =
    "(3, 198, 2) px: initial marker positions, those of the previous step and of this one; left finger first";
/// Meaning of the joint positions that are observed in addition to the state.
pub(super) const JOINT_STATE: &str = "measured positions of the seven joints of the arm (rad)";
/// Meaning of the torques.
pub(super) const TORQUES: &str = "torques of the arm's drives (N m), without gravity";

/// The human-readable description, with the metadata that Hugging Face's hub reads.
pub(super) fn readme<Key: Fn(&'static str) -> String>(
    job: &ExportJob<'_>,
    format: &FormatText<'_, Key>,
) -> String {
    let ExportSummary { episodes, frames, tasks } = job.selection.summary();
    let FormatText { hub, name, key, more_keys, files } = format;
    let (state, action) = (state(job.config.control), action(job));
    let torques = match job.selection.has_joint_torques {
        true => format!("| `{}` | {TORQUES} |\n", key("joint_torques")),
        false => String::new(),
    };
    let [image, wrist, tactile] = IMAGE_FEATURES.map(key);
    let (markers_key, state_key, action_key) = (key("tactile_marker_motion"), key("state"), key("actions"));
    let safe =
        if job.selection.is_safe { " and is safe by softvt's evaluator" } else { "; some are not safe" };
    let prompts: String = job.selection.prompts.iter().map(|prompt| format!("- {prompt}\n")).collect();
    format!(
        "---\nlicense: apache-2.0\ntask_categories:\n- robotics\n{hub}---\n\
         # Demonstrations of soft-object manipulation, {name}\n\n\
         {episodes} episodes, {frames} frames at {} Hz, {tasks} prompts; exported by softvt {} from a recording in \
         simulation. Every episode reaches its goal{safe}.\n\n\
         Frame t holds the observation of a policy at step t and the action commanded then.\n\n\
         | key | |\n|---|---|\n\
         | `{image}`, `{wrist}` | third person and wrist |\n\
         | `{tactile}` | {MOSAIC} |\n\
         | `{markers_key}` | {MARKERS} |\n\
         | `{state_key}` | {state} |\n\
         | `{action_key}` | {action} |\n{torques}{more_keys}\n\
         {files}\n\n\
         {prompts}",
        CONTROL_HZ,
        env!("CARGO_PKG_VERSION"),
    )
}
