//! Version 2.1: one table per episode, and JSON lines about the episodes.

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
    config::CHUNK,
    episode::{EpisodeData, EpisodeWriter},
    features::{self, Feature},
    parquet_table::{KeyValueNote, ParquetColumn, ParquetTable},
    statistics::{FeatureStatistics, NestedList},
};
use crate::{dataset::DatasetError, files};

/// Writes a file of JSON lines.
struct JsonLinesWriter {
    file: BufWriter<File>,
    path: PathBuf,
}

impl JsonLinesWriter {
    fn create(path: PathBuf) -> Result<Self, DatasetError> {
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

/// A line of `episodes_stats.jsonl`.
#[derive(Serialize)]
struct StatisticsLine {
    episode_index: usize,
    stats: BTreeMap<&'static str, BTreeMap<&'static str, NestedList>>,
}

pub(super) struct Writer21 {
    dir: PathBuf,
    columns: Arc<[ParquetColumn]>,
    note: KeyValueNote,
    episodes: JsonLinesWriter,
    stats: JsonLinesWriter,
}

impl Writer21 {
    /// `dir` is empty.
    pub(super) fn create(dir: &Path, features: &[Feature]) -> Result<Self, DatasetError> {
        files::create_folder(&dir.join("meta"))?;
        Ok(Self {
            dir: dir.to_owned(),
            columns: features.iter().map(Feature::column).collect(),
            note: features::hugging_face_note(features),
            episodes: JsonLinesWriter::create(dir.join("meta/episodes.jsonl"))?,
            stats: JsonLinesWriter::create(dir.join("meta/episodes_stats.jsonl"))?,
        })
    }
}

/// LeRobot's name of the image of a step.
fn image_name(step: usize) -> String {
    format!("frame_{step:06}.png")
}

impl EpisodeWriter for Writer21 {
    fn add(&mut self, episode: EpisodeData<'_>) -> Result<(), DatasetError> {
        let (index, steps) = (episode.index, episode.rows.steps);
        let line = json!({ "episode_index": index, "tasks": [episode.demo.entry.language], "length": steps });
        // The values were measured in single precision, and LeRobot reads this file completely.
        let single = |x: f64| NestedList::Single(x as f32);
        let named = |feature: &FeatureStatistics| {
            let figures: BTreeMap<_, _> = feature.figures(false).nested(single).into_iter().collect();
            (feature.name, figures)
        };
        let stats = episode.statistics.iter().map(named).collect();
        let path = self.dir.join(format!("data/chunk-{:03}/episode_{index:06}.parquet", index / CHUNK));
        files::create_folder(path.parent().unwrap_or(&self.dir))?;
        let mut table = ParquetTable::create(path, &self.columns, std::slice::from_ref(&self.note))?;
        table.append(steps, episode.into_columns(image_name))?;
        table.finish()?;
        self.episodes.add(&line)?;
        self.stats.add(&StatisticsLine { episode_index: index, stats })
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        self.episodes.finish()?;
        self.stats.finish()
    }
}
