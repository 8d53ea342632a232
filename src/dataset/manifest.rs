//! `manifest.jsonl`: one line per demonstration, with SoftVTBench's field names.

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize};

use super::{
    DatasetError,
    layout::{DATASET, MANIFEST, RECORDING, TaskPaths, VIDEO_STREAMS},
};
use softvt_common::files;
use softvt_runs::record::{DemonstrationOrigin, EpisodeRecord};

pub const SCHEMA_VERSION: u32 = 1;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManifestEntry {
    pub schema_version: u32,
    pub suite: String,
    /// The suite again, under SoftVTBench's name.
    pub task_suite: String,
    pub task_id: usize,
    /// Index of the attempt in the split of demonstrations.
    pub episode: u32,
    /// Index of the demonstration in its file.
    pub demo_id: usize,
    /// HDF5 file, relative to the dataset.
    pub hdf5_path: String,
    pub num_samples: usize,
    pub language: String,
    pub asset_name: String,
    /// True if it is safe; false only where `--keep goal` kept an unsafe one.
    pub success: bool,
    /// Largest peak D of a target, %; null for rigid ones.
    pub d_peak: Option<f64>,
    pub seed: u64,
    pub state_hash: String,
    /// Numbers noted by the expert, such as the grip that it chose.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub notes: BTreeMap<String, f64>,
    /// Metrics of the suite, by name; null for those without a value.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub metrics: BTreeMap<String, Option<f64>>,
    /// Imported demonstration of which it is a re-execution.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Box<DemonstrationOrigin>>,
    /// Videos by stream, relative to the dataset.
    pub video_files: BTreeMap<String, String>,
}

impl ManifestEntry {
    /// The line of demonstration `demo` of a task.
    pub fn new(paths: &TaskPaths, demo: usize, record: &EpisodeRecord) -> Self {
        let header = &record.header;
        let id = &header.id;
        let videos = VIDEO_STREAMS.iter().enumerate();
        Self {
            schema_version: SCHEMA_VERSION,
            suite: id.suite.clone(),
            task_suite: id.suite.clone(),
            task_id: id.task,
            episode: id.episode,
            demo_id: demo,
            hdf5_path: paths.hdf5_relative(),
            num_samples: record.stats.steps as usize,
            language: header.prompt.clone(),
            asset_name: header.asset.clone(),
            success: record.verdict.safety,
            d_peak: record.d_peak(),
            seed: id.base_seed,
            state_hash: record.stats.state_hash.clone(),
            notes: record.stats.notes.clone(),
            metrics: record.stats.metrics.clone(),
            origin: header.origin.clone(),
            video_files: videos
                .map(|(i, name)| ((*name).to_owned(), paths.video_relative(demo, i)))
                .collect(),
        }
    }
}

pub fn write(root: &Path, entries: &[ManifestEntry]) -> Result<(), DatasetError> {
    Ok(files::write_json_lines(&root.join(MANIFEST), entries)?)
}

/// # Errors
/// The file cannot be read, or a line is not an entry.
pub fn read(root: &Path) -> Result<Vec<ManifestEntry>, DatasetError> {
    let path = root.join(MANIFEST);
    if root.join(RECORDING).is_file() && !root.join(DATASET).is_file() {
        let what = "it is missing; the recording was interrupted: repeat its command with --resume";
        return Err(DatasetError::content(root, DATASET, what));
    }
    if !path.exists() {
        let what = match root.join("meta/info.json").is_file() {
            true => {
                "it is missing; the folder is a LeRobot dataset: give the recording that it was exported from"
            }
            false => "it is missing; expected the folder of a finished recording",
        };
        return Err(DatasetError::content(root, MANIFEST, what));
    }
    let text = files::read_text(&path)?;
    let parse = |(i, line): (usize, &str)| {
        serde_json::from_str(line)
            .map_err(|e| DatasetError::content(&path, format!("line {}", i + 1), e.to_string()))
    };
    text.lines().enumerate().map(parse).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_evaluation::verdict::TargetVerdict;

    #[test]
    fn a_second_target_that_deformed_more_has_its_peak_in_the_manifest() {
        let record = include_str!("../../tests/data/episode_record.json");
        let mut record: EpisodeRecord = serde_json::from_str(record).expect("a valid record");
        let other = TargetVerdict { soft: true, d_peak: Some(3.0), ..TargetVerdict::default() };
        record.verdict.targets.push(other);
        let paths = TaskPaths { root: "d".into(), suite: "suite".to_owned(), task: 0 };
        assert_eq!(ManifestEntry::new(&paths, 0, &record).d_peak, Some(3.0));
    }
}
