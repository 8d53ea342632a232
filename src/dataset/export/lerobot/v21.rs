//! Version 2.1: one table per episode, and JSON lines about the episodes.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::Serialize;
use serde_json::{Value, json};

use super::{
    episode::{EpisodeData, LerobotEpisodeWriter},
    parquet_table::{ParquetTable, TableSchema},
    statistics::{FeatureStatistics, NestedList},
    version::CHUNK,
};
use crate::DatasetError;
use softvt_common::files;

/// A line of `episodes_stats.jsonl`.
#[derive(Serialize)]
struct StatisticsLine {
    episode_index: usize,
    stats: BTreeMap<&'static str, BTreeMap<&'static str, NestedList>>,
}

/// Writes one table per episode, and at the end the lines about the episodes.
pub(super) struct EpisodeTableWriter {
    dir: PathBuf,
    schema: TableSchema,
    episodes: Vec<Value>,
    /// Lines of `episodes_stats.jsonl`: as text, which takes a third of the memory.
    stats: String,
}

impl EpisodeTableWriter {
    /// `dir` is empty.
    pub(super) fn create(dir: &Path, schema: TableSchema) -> Result<Self, DatasetError> {
        files::create_folder(&dir.join("meta"))?;
        Ok(Self { dir: dir.to_owned(), schema, episodes: Vec::new(), stats: String::new() })
    }

    fn stats_path(&self) -> PathBuf {
        self.dir.join("meta/episodes_stats.jsonl")
    }
}

impl LerobotEpisodeWriter for EpisodeTableWriter {
    fn add(&mut self, episode: EpisodeData<'_>) -> Result<(), DatasetError> {
        let (index, steps) = (episode.index, episode.demo.entry.num_samples);
        // The values were measured in single precision, and LeRobot reads this file completely.
        let single = |x: f64| NestedList::Single(x as f32);
        let named = |f: &FeatureStatistics| (f.name, f.nested(false, single).into_iter().collect());
        let stats = episode.statistics.iter().map(named).collect();
        let path = self.dir.join(format!("data/chunk-{:03}/episode_{index:06}.parquet", index / CHUNK));
        files::create_parent(&path)?;
        let mut table = ParquetTable::create(path, &self.schema)?;
        table.append(steps, episode.columns)?;
        table.finish()?;
        let prompt = &episode.demo.entry.language;
        self.episodes.push(json!({ "episode_index": index, "tasks": [prompt], "length": steps }));
        self.stats +=
            &files::json_lines(&self.stats_path(), [StatisticsLine { episode_index: index, stats }])?;
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        files::write_json_lines(&self.dir.join("meta/episodes.jsonl"), &self.episodes)?;
        Ok(files::replace(&self.stats_path(), &self.stats)?)
    }
}
