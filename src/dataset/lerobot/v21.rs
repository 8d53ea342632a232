//! LeRobotVersion 2.1: a table an episode, and lines of JSON about them.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::Serialize;
use serde_json::json;

use super::{
    ExportedEpisode, FeatureStatistics, FormatWriter,
    features::{self, Feature},
    meta::CHUNK,
    parquet_table::{ParquetColumn, ParquetTable},
    statistics::NestedList,
};
use crate::{dataset::DatasetError, files};

/// Where a table is, in Python's words.
pub(super) const DATA_PATH: &str = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet";

/// A file of lines of JSON.
struct Lines {
    file: BufWriter<File>,
    path: PathBuf,
}

impl Lines {
    fn begin(path: PathBuf) -> Result<Self, DatasetError> {
        let file = File::create(&path).map_err(DatasetError::io("write", &path))?;
        Ok(Self { file: BufWriter::new(file), path })
    }

    fn add(&mut self, line: &impl Serialize) -> Result<(), DatasetError> {
        let text = serde_json::to_string(line)
            .map_err(|e| DatasetError::content(&self.path, "line", e.to_string()))?;
        writeln!(self.file, "{text}").map_err(DatasetError::io("write", &self.path))
    }

    fn finish(self) -> Result<(), DatasetError> {
        let failed = DatasetError::io("write", &self.path);
        let file = self.file.into_inner().map_err(std::io::IntoInnerError::into_error);
        file.and_then(|file| file.sync_all()).map_err(failed)
    }
}

/// What is told of an episode's features.
#[derive(Serialize)]
struct Line {
    episode_index: usize,
    stats: BTreeMap<&'static str, BTreeMap<&'static str, NestedList>>,
}

/// Writes it.
pub(super) struct Writer {
    dir: PathBuf,
    columns: Arc<[ParquetColumn]>,
    note: (&'static str, String),
    episodes: Lines,
    stats: Lines,
}

impl Writer {
    /// InitialCondition in a folder that is empty.
    pub(super) fn begin(dir: &Path, features: &[Feature]) -> Result<Self, DatasetError> {
        files::create_folder(&dir.join("meta"))?;
        Ok(Self {
            dir: dir.to_owned(),
            columns: features.iter().map(Feature::column).collect(),
            note: features::note(features),
            episodes: Lines::begin(dir.join("meta/episodes.jsonl"))?,
            stats: Lines::begin(dir.join("meta/episodes_stats.jsonl"))?,
        })
    }
}

/// What LeRobot calls the picture of a step.
fn picture(step: usize) -> String {
    format!("frame_{step:06}.png")
}

impl FormatWriter for Writer {
    fn add(&mut self, episode: ExportedEpisode<'_>) -> Result<(), DatasetError> {
        let ExportedEpisode { index, source, rows, summaries } = episode;
        let path = format!("data/chunk-{:03}/episode_{index:06}.parquet", index / CHUNK);
        let path = self.dir.join(path);
        files::create_folder(path.parent().unwrap_or(&self.dir))?;
        let mut table = ParquetTable::create(path, &self.columns, std::slice::from_ref(&self.note))?;
        let steps = rows.steps;
        table.append(steps, ExportedEpisode::columns(rows, (index, source), picture))?;
        table.finish()?;
        let told = json!({ "episode_index": index, "tasks": [source.entry.language], "length": steps });
        self.episodes.add(&told)?;
        // What was measured in single precision needs no more digits: this file is read whole.
        let single = |x: f64| NestedList::Single(x as f32);
        let named = |summary: &FeatureStatistics| {
            let figures: BTreeMap<_, _> = summary.figures(false).nested(single).into_iter().collect();
            (summary.name, figures)
        };
        let stats = summaries.iter().map(named).collect();
        self.stats.add(&Line { episode_index: index, stats })
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        self.episodes.finish()?;
        self.stats.finish()
    }
}
