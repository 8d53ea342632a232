//! Files of `meta/` about the whole dataset, and its `README.md`.

use std::path::Path;

use parquet::file::metadata::KeyValue;
use serde_json::{Value, json};

use super::{
    config::{ArmControl, CHUNK, ExportConfig, ExportSummary, LeRobotVersion, MAX_TABLE_MB},
    features::{self, Feature},
    parquet_table::{ColumnType, ColumnValues, ParquetColumn, ParquetTable},
    selection::{SelectedDemo, Selection},
};
use crate::{
    DatasetError,
    demonstration::{JOINT_ACTIONS, actions_stream_name},
};
use softvt_benchmark::CONTROL_HZ;
use softvt_common::files;
use softvt_policy::profile::GripCode;

/// Writes all files that do not describe single episodes. `info.json` is last: LeRobot opens nothing without it.
pub(super) fn write(
    dir: &Path,
    config: &ExportConfig,
    selection: &Selection,
    features: &[Feature],
    summary: ExportSummary,
) -> Result<(), DatasetError> {
    match config.version {
        LeRobotVersion::V21 => write_task_lines(dir, &selection.prompts)?,
        LeRobotVersion::V30 => write_task_table(dir, &selection.prompts)?,
    }
    write_origins(dir, selection)?;
    let grip_stream = actions_stream_name(selection.gripper);
    let encoding = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "control": config.control.name(),
        "gripper": selection.gripper.name(),
        "source": match config.control {
            ArmControl::Pose => grip_stream.to_owned(),
            ArmControl::Joints => format!("{JOINT_ACTIONS}, gripper of {grip_stream}"),
        },
    });
    files::write_json(&dir.join("meta/softvt.json"), &encoding)?;
    files::replace(&dir.join("README.md"), readme(config, selection, summary))?;
    Ok(files::write_json(&dir.join("meta/info.json"), &info(config.version, features, summary))?)
}

fn info(version: LeRobotVersion, features: &[Feature], summary: ExportSummary) -> Value {
    let ExportSummary { episodes, frames, tasks } = summary;
    let mut info = json!({
        "codebase_version": version.code(),
        "robot_type": "franka",
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": tasks,
    });
    match version {
        LeRobotVersion::V21 => {
            info["total_videos"] = json!(0);
            info["total_chunks"] = json!(episodes.div_ceil(CHUNK));
            info["chunks_size"] = json!(CHUNK);
        }
        LeRobotVersion::V30 => {
            info["chunks_size"] = json!(CHUNK);
            info["data_files_size_in_mb"] = json!(MAX_TABLE_MB);
            info["video_files_size_in_mb"] = json!(200);
        }
    }
    info["fps"] = json!(CONTROL_HZ);
    info["splits"] = json!({ "train": format!("0:{episodes}") });
    info["data_path"] = json!(version.data_path());
    info["video_path"] = Value::Null;
    info["features"] = features::info(features);
    info
}

fn write_task_lines(dir: &Path, prompts: &[String]) -> Result<(), DatasetError> {
    let lines = prompts.iter().enumerate().map(|(i, prompt)| json!({ "task_index": i, "task": prompt }));
    Ok(files::write_json_lines(&dir.join("meta/tasks.jsonl"), lines)?)
}

/// The table that pandas writes for a data frame indexed by the prompts; its metadata declare the index.
fn write_task_table(dir: &Path, prompts: &[String]) -> Result<(), DatasetError> {
    const INDEX: &str = "__index_level_0__";
    let column = |name: Value, field: &str, pandas: &str, numpy: &str| json!({ "name": name, "field_name": field, "pandas_type": pandas, "numpy_type": numpy, "metadata": null });
    let note = json!({
        "index_columns": [INDEX],
        "column_indexes": [{ "name": null, "field_name": null, "pandas_type": "unicode", "numpy_type": "object", "metadata": { "encoding": "UTF-8" } }],
        "columns": [
            column(json!("task_index"), "task_index", "int64", "int64"),
            column(Value::Null, INDEX, "unicode", "object"),
        ],
        "creator": { "library": "softvt", "version": env!("CARGO_PKG_VERSION") },
        "pandas_version": "2.2.0",
    });
    let indices = (0..prompts.len()).map(|i| i as i64).collect();
    let columns = vec![
        (ParquetColumn::new("task_index", ColumnType::I64, &[]), ColumnValues::I64(indices)),
        (ParquetColumn::new(INDEX, ColumnType::Text, &[]), ColumnValues::Text(prompts.to_vec())),
    ];
    let metadata = vec![KeyValue::new("pandas".to_owned(), note.to_string())];
    ParquetTable::write(dir.join("meta/tasks.parquet"), prompts.len(), columns, metadata)
}

/// `softvt.jsonl`: the demonstration that each episode comes from.
fn write_origins(dir: &Path, selection: &Selection) -> Result<(), DatasetError> {
    let line = |(index, SelectedDemo { entry, .. }): (usize, &SelectedDemo)| {
        json!({
            "episode_index": index,
            "suite": entry.suite,
            "task_id": entry.task_id,
            "demo_id": entry.demo_id,
            "asset_name": entry.asset_name,
            "d_peak": entry.d_peak,
            "seed": entry.seed,
            "episode": entry.episode,
            "state_hash": entry.state_hash,
            "gripper": selection.gripper.name(),
        })
    };
    let lines = selection.demos.iter().enumerate().map(line);
    Ok(files::write_json_lines(&dir.join("meta/softvt.jsonl"), lines)?)
}

/// The human-readable description, with the metadata that Hugging Face's hub reads.
fn readme(config: &ExportConfig, selection: &Selection, summary: ExportSummary) -> String {
    let ExportSummary { episodes, frames, tasks } = summary;
    let gripper = match selection.gripper {
        GripCode::Continuous => "the commanded closure, 0 open to 1 closed",
        GripCode::Binary => "1 while the gripper is commanded to hold, else 0",
        GripCode::TwoWidth => {
            "closure 0 while open, the median commanded closure of the demonstration while closed"
        }
        GripCode::Force => "grip force in N while closed, -1 while open",
    };
    let (arm, motion) = match config.control {
        ArmControl::Pose => (
            "tool position (m), axis-angle (rad) in the robot's base frame",
            "absolute tool position and axis-angle",
        ),
        ArmControl::Joints => {
            ("positions of the seven joints of the arm (rad)", "commanded joint positions (rad)")
        }
    };
    let key = |name| config.version.key(name);
    let torques = match selection.has_joint_torques {
        true => {
            format!("| `{}` | torques of the arm's drives (N m), without gravity |\n", key("joint_torques"))
        }
        false => String::new(),
    };
    let [image, wrist, tactile] = features::IMAGE_FEATURES.map(key);
    let (markers, state, actions) = (key("tactile_marker_motion"), key("state"), key("actions"));
    let prompts: String = selection.prompts.iter().map(|prompt| format!("- {prompt}\n")).collect();
    format!(
        "---\nlicense: apache-2.0\ntask_categories:\n- robotics\ntags:\n- LeRobot\nconfigs:\n- config_name: default\n  \
         data_files: data/*/*.parquet\n---\n\
         # Demonstrations of soft-object manipulation, LeRobot {}\n\n\
         {episodes} episodes, {frames} frames at {} Hz, {tasks} prompts; exported by softvt {} from a recording in \
         simulation. Every episode reaches its goal and is safe by softvt's evaluator.\n\n\
         Frame t holds the observation of a policy at step t and the action commanded then.\n\n\
         | key | |\n|---|---|\n\
         | `{image}`, `{wrist}` | third person and wrist |\n\
         | `{tactile}` | 4 × 4 cells: the last 8 images of the left finger above, of the right finger below |\n\
         | `{markers}` | (3, 198, 2) px: initial marker positions, those of the previous step and of this one; left finger first |\n\
         | `{state}` | {arm}; position of one finger, 0 closed to 0.04 m |\n\
         | `{actions}` | {motion}; {gripper} |\n{torques}\n\
         `meta/softvt.json` states the control ({}) and the grip code ({}), and `meta/softvt.jsonl` the demonstration of each episode.\n\n\
         {prompts}",
        config.version.code(),
        CONTROL_HZ,
        env!("CARGO_PKG_VERSION"),
        config.control.name(),
        selection.gripper.name(),
    )
}
