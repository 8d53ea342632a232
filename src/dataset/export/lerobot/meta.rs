//! Files of `meta/` about the whole dataset, and its `README.md`.

use std::path::Path;

use parquet::file::metadata::KeyValue;
use serde_json::{Value, json};

use super::{
    features::{self, Column},
    parquet_table::{ColumnType, ColumnValues, ParquetColumn, ParquetTable},
    version::{CHUNK, LeRobotVersion, MAX_TABLE_MB},
};
use crate::{
    DatasetError,
    export::{
        ExportJob, ExportSummary,
        description::{self, FormatText},
        features::Feature,
        selection::{SelectedDemo, Selection},
    },
};
use softvt_benchmark::CONTROL_HZ;
use softvt_common::files;

/// Writes all files that do not describe single episodes. `info.json` is last: LeRobot opens nothing without it.
pub(super) fn write(
    job: &ExportJob<'_>,
    version: LeRobotVersion,
    features: &[Column],
) -> Result<(), DatasetError> {
    let ExportJob { dir, selection, .. } = job;
    match version {
        LeRobotVersion::V21 => {
            let line = |(i, prompt): (usize, &String)| json!({ "task_index": i, "task": prompt });
            let lines = selection.prompts.iter().enumerate().map(line);
            files::write_json_lines(&dir.join("meta/tasks.jsonl"), lines)?;
        }
        LeRobotVersion::V30 => write_task_table(dir, &selection.prompts)?,
    }
    write_origins(dir, selection)?;
    files::write_json(&dir.join("meta/softvt.json"), &description::encoding(job))?;
    files::replace(&dir.join("README.md"), readme(job, version))?;
    Ok(files::write_json(&dir.join("meta/info.json"), &info(version, features, selection.summary()))?)
}

fn info(version: LeRobotVersion, features: &[Column], summary: ExportSummary) -> Value {
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

fn readme(job: &ExportJob<'_>, version: LeRobotVersion) -> String {
    let encoding = format!(
        "`meta/softvt.json` states the control ({}) and the grip code ({}), and `meta/softvt.jsonl` the demonstration of each episode.",
        job.config.control.name(),
        job.selection.gripper.name(),
    );
    description::readme(
        job,
        &FormatText {
            hub: "tags:\n- LeRobot\nconfigs:\n- config_name: default\n  data_files: data/*/*.parquet\n",
            name: &format!("LeRobot {}", version.code()),
            key: |feature: &Feature| version.key(feature).map(str::to_owned),
            files: encoding,
        },
    )
}
