//! Version 2.1: one table per episode, and JSON lines about the episodes.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use serde::Serialize;
use serde_json::json;

use super::{
    episode::{EpisodeData, LerobotEpisodeWriter},
    parquet_table::{ParquetTable, TableSchema},
    statistics::{FeatureStatistics, NestedList},
    version::CHUNK,
};
use crate::DatasetError;
use softvt_common::files::{self, FileError};

/// Writes a file of JSON lines.
struct JsonLinesWriter {
    file: BufWriter<File>,
    path: PathBuf,
}

impl JsonLinesWriter {
    fn create(path: PathBuf) -> Result<Self, FileError> {
        let file = File::create(&path).map_err(FileError::io("write", &path))?;
        Ok(Self { file: BufWriter::new(file), path })
    }

    fn add(&mut self, line: &impl Serialize) -> Result<(), FileError> {
        let written = serde_json::to_writer(&mut self.file, line).map_err(io::Error::from);
        written.and_then(|()| writeln!(self.file)).map_err(FileError::io("write", &self.path))
    }

    fn finish(self) -> Result<(), FileError> {
        let file = self.file.into_inner().map_err(io::IntoInnerError::into_error);
        file.and_then(|file| file.sync_all()).map_err(FileError::io("write", &self.path))
    }
}

/// A line of `episodes_stats.jsonl`.
#[derive(Serialize)]
struct StatisticsLine {
    episode_index: usize,
    stats: BTreeMap<&'static str, BTreeMap<&'static str, NestedList>>,
}

/// Writes one table per episode.
pub(super) struct EpisodeTableWriter {
    dir: PathBuf,
    schema: TableSchema,
    episodes: JsonLinesWriter,
    stats: JsonLinesWriter,
}

impl EpisodeTableWriter {
    /// `dir` is empty.
    pub(super) fn create(dir: &Path, schema: TableSchema) -> Result<Self, DatasetError> {
        files::create_folder(&dir.join("meta"))?;
        Ok(Self {
            dir: dir.to_owned(),
            schema,
            episodes: JsonLinesWriter::create(dir.join("meta/episodes.jsonl"))?,
            stats: JsonLinesWriter::create(dir.join("meta/episodes_stats.jsonl"))?,
        })
    }
}

impl LerobotEpisodeWriter for EpisodeTableWriter {
    fn add(&mut self, episode: EpisodeData<'_>) -> Result<(), DatasetError> {
        let (index, steps) = (episode.index, episode.demo.entry.num_samples);
        let line = json!({ "episode_index": index, "tasks": [episode.demo.entry.language], "length": steps });
        // The values were measured in single precision, and LeRobot reads this file completely.
        let single = |x: f64| NestedList::Single(x as f32);
        let named = |f: &FeatureStatistics| (f.name, f.nested(false, single).into_iter().collect());
        let stats = episode.statistics.iter().map(named).collect();
        let path = self.dir.join(format!("data/chunk-{:03}/episode_{index:06}.parquet", index / CHUNK));
        files::create_parent(&path)?;
        let mut table = ParquetTable::create(path, &self.schema)?;
        table.append(steps, episode.columns)?;
        table.finish()?;
        self.episodes.add(&line)?;
        Ok(self.stats.add(&StatisticsLine { episode_index: index, stats })?)
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        self.episodes.finish()?;
        Ok(self.stats.finish()?)
    }
}
