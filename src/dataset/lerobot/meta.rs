//! What a data set says of itself: `meta/` and the card for people.

use std::path::Path;

use serde_json::{Value, json};

use super::{
    ExportConfig, ExportSummary, GripperCoding, LeRobotVersion,
    features::{self, Feature},
    parquet_table::{ColumnType, ColumnValues, ParquetColumn, ParquetTable},
    selection::{SelectedDemo, Selection},
    statistics::{FeatureStatistics, ValueStatistics},
    timestamp, v21, v30,
};
use crate::{
    dataset::{DatasetError, demonstration_writer::frame_rate},
    files,
};

/// Files in a folder.
pub(super) const CHUNK: usize = 1000;

/// Writes a file of JSON for people and programs.
pub(super) fn json(path: &Path, value: &Value) -> Result<(), DatasetError> {
    Ok(files::replace(path, format!("{value:#}\n").as_bytes())?)
}

/// Writes everything but what tells of single episodes; `info.json` last: LeRobot opens nothing without it.
pub(super) fn write(
    dir: &Path,
    export: &ExportConfig,
    chosen: &Selection,
    features: &[Feature],
    exported: ExportSummary,
) -> Result<(), DatasetError> {
    match export.version {
        LeRobotVersion::V21 => task_lines(dir, &chosen.prompts)?,
        LeRobotVersion::V30 => task_table(dir, &chosen.prompts)?,
    }
    origins(dir, export, chosen)?;
    files::replace(&dir.join("README.md"), card(export, chosen, exported).as_bytes())?;
    json(&dir.join("meta/info.json"), &info(export.version, features, exported))
}

fn info(version: LeRobotVersion, features: &[Feature], exported: ExportSummary) -> Value {
    let ExportSummary { episodes, frames, tasks } = exported;
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
            info["data_files_size_in_mb"] = json!(v30::TABLE_MB);
            info["video_files_size_in_mb"] = json!(200);
        }
    }
    info["fps"] = json!(frame_rate());
    info["splits"] = json!({ "train": format!("0:{episodes}") });
    info["data_path"] = json!(match version {
        LeRobotVersion::V21 => v21::DATA_PATH,
        LeRobotVersion::V30 => v30::DATA_PATH,
    });
    info["video_path"] = Value::Null;
    info["features"] = features::info(features);
    info
}

fn task_lines(dir: &Path, prompts: &[String]) -> Result<(), DatasetError> {
    let line =
        |(index, prompt): (usize, &String)| format!("{}\n", json!({ "task_index": index, "task": prompt }));
    let text: String = prompts.iter().enumerate().map(line).collect();
    Ok(files::replace(&dir.join("meta/tasks.jsonl"), text.as_bytes())?)
}

/// A table as pandas writes a frame whose index are the prompts: its note says so.
fn task_table(dir: &Path, prompts: &[String]) -> Result<(), DatasetError> {
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
    let columns = [
        ParquetColumn::new("task_index", ColumnType::I64, &[]),
        ParquetColumn::new(INDEX, ColumnType::Text, &[]),
    ];
    let path = dir.join("meta/tasks.parquet");
    let mut table = ParquetTable::create(path, &columns.into(), &[("pandas", note.to_string())])?;
    let indices = (0..prompts.len()).map(|i| i as i64).collect();
    table.append(prompts.len(), vec![ColumnValues::I64(indices), ColumnValues::Text(prompts.to_vec())])?;
    table.finish()
}

/// Which demonstration each episode is.
fn origins(dir: &Path, export: &ExportConfig, chosen: &Selection) -> Result<(), DatasetError> {
    let line = |(index, source): (usize, &SelectedDemo)| {
        let entry = &source.entry;
        let told = json!({
            "episode_index": index,
            "suite": entry.suite,
            "task_id": entry.task_id,
            "demo_id": entry.demo_id,
            "asset_name": entry.asset_name,
            "d_peak": entry.d_peak,
            "seed": entry.seed,
            "episode": entry.episode,
            "state_hash": entry.state_hash,
            "gripper": code(export.gripper),
        });
        format!("{told}\n")
    };
    let text: String = chosen.sources.iter().enumerate().map(line).collect();
    Ok(files::replace(&dir.join("meta/softvt.jsonl"), text.as_bytes())?)
}

fn code(gripper: GripperCoding) -> &'static str {
    match gripper {
        GripperCoding::Continuous => "continuous",
        GripperCoding::Binary => "binary",
    }
}

/// The page for people, with what Hugging Face's hub reads of it.
fn card(export: &ExportConfig, chosen: &Selection, exported: ExportSummary) -> String {
    let ExportSummary { episodes, frames, tasks } = exported;
    let gripper = match export.gripper {
        GripperCoding::Continuous => "the commanded closure, 0 open to 1 shut",
        GripperCoding::Binary => "1 while the gripper is meant to hold, else 0",
    };
    let prompts: String = chosen.prompts.iter().map(|prompt| format!("- {prompt}\n")).collect();
    format!(
        "---\nlicense: apache-2.0\ntask_categories:\n- robotics\ntags:\n- LeRobot\nconfigs:\n- config_name: default\n  \
         data_files: data/*/*.parquet\n---\n\
         # Demonstrations of soft-object manipulation, LeRobot {}\n\n\
         {episodes} episodes, {frames} frames at {} Hz, {tasks} prompts; exported by softvt {} from its own recording in \
         simulation. Every episode reaches its goal and is safe by softvt's evaluator.\n\n\
         Frame t holds what a policy is sent when it is asked at step t, and what was commanded then.\n\n\
         | key | |\n|---|---|\n\
         | `image`, `wrist_image` | third person and wrist |\n\
         | `tactile_image` | 4 × 4 cells: the last 8 pictures of the left finger above, of the right below |\n\
         | `tactile_marker_motion` | (3, 198, 2) px: initial places, those of the step before and of this one; left finger first |\n\
         | `state` | tool position (m), axis-angle (rad) in the robot's base frame; position of one finger, 0 shut to 0.04 m |\n\
         | `actions` | absolute tool position and axis-angle; {gripper} |\n\n\
         `meta/softvt.jsonl` says of which demonstration each episode is.\n\n{prompts}",
        export.version.code(),
        frame_rate(),
        env!("CARGO_PKG_VERSION"),
    )
}

/// The numbers that LeRobot adds to every row, as a whole.
pub(super) fn numbered(index: usize, source: &SelectedDemo) -> Vec<FeatureStatistics> {
    let steps = source.entry.num_samples;
    let all = |name, numbers: Vec<f64>| FeatureStatistics {
        name,
        shape: vec![1],
        steps: steps as u64,
        parts: vec![ValueStatistics::of(numbers)],
    };
    let counted = |from: usize| (from..from + steps).map(|i| i as f64).collect();
    let same = |number: usize| vec![number as f64; steps];
    vec![
        all("timestamp", (0..steps).map(|step| f64::from(timestamp(step))).collect()),
        all("frame_index", counted(0)),
        all("episode_index", same(index)),
        all("index", counted(source.first)),
        all("task_index", same(source.task)),
    ]
}
