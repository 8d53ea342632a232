//! Version 3.0: many episodes per table, one row group each, and tables about the episodes.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde_json::{Map, Value, json};

use super::{
    config::{CHUNK, MAX_TABLE_MB},
    episode::{EpisodeData, EpisodeWriter},
    features::{self, Feature},
    parquet_table::{ColumnType, ColumnValues, KeyValueNote, ParquetColumn, ParquetTable},
    statistics::{FeatureFigures, FeatureStatistics, NestedList},
};
use crate::{dataset::DatasetError, files};

/// Episodes per table about episodes: some 60 MB.
const EPISODES_PER_TABLE: usize = 10_000;

/// Path of the n-th file of a kind; its folder is created.
fn numbered_path(dir: &Path, kind: &str, file: usize) -> Result<PathBuf, DatasetError> {
    let folder = dir.join(format!("{kind}/chunk-{:03}", file / CHUNK));
    files::create_folder(&folder)?;
    Ok(folder.join(format!("file-{:03}.parquet", file % CHUNK)))
}

/// Row of a table about episodes.
struct EpisodeSummary {
    index: usize,
    prompt: String,
    steps: usize,
    first_frame: usize,
    /// Number of the file that holds its rows.
    file: usize,
    figures: Vec<FeatureFigures>,
}

pub(super) struct Writer30 {
    dir: PathBuf,
    columns: Arc<[ParquetColumn]>,
    note: KeyValueNote,
    /// The table that is being written, and its number.
    table: Option<ParquetTable>,
    file: usize,
    episodes: Vec<EpisodeSummary>,
    /// Statistics of all episodes.
    total: Vec<FeatureStatistics>,
}

impl Writer30 {
    /// `dir` is empty.
    pub(super) fn create(dir: &Path, features: &[Feature]) -> Result<Self, DatasetError> {
        files::create_folder(&dir.join("meta"))?;
        Ok(Self {
            dir: dir.to_owned(),
            columns: features.iter().map(Feature::column).collect(),
            note: features::hugging_face_note(features),
            table: None,
            file: 0,
            episodes: Vec::new(),
            total: Vec::new(),
        })
    }

    /// A table with space for `bytes` more; a full one is finished first.
    fn table(&mut self, bytes: usize) -> Result<&mut ParquetTable, DatasetError> {
        let table = match self.table.take() {
            Some(table) if table.bytes() + bytes <= MAX_TABLE_MB << 20 => table,
            full => {
                if let Some(full) = full {
                    full.finish()?;
                    self.file += 1;
                }
                let path = numbered_path(&self.dir, "data", self.file)?;
                ParquetTable::create(path, &self.columns, std::slice::from_ref(&self.note))?
            }
        };
        Ok(self.table.insert(table))
    }
}

/// LeRobot's name of the image of a step.
fn image_name(step: usize) -> String {
    format!("frame-{step:06}.png")
}

impl EpisodeWriter for Writer30 {
    fn add(&mut self, mut episode: EpisodeData<'_>) -> Result<(), DatasetError> {
        let (index, demo, steps) = (episode.index, episode.demo, episode.rows.steps);
        let statistics = std::mem::take(&mut episode.statistics);
        let bytes = episode.rows.images.iter().flatten().map(Vec::len).sum();
        self.table(bytes)?.append(steps, episode.into_columns(image_name))?;
        self.episodes.push(EpisodeSummary {
            index,
            prompt: demo.entry.language.clone(),
            steps,
            first_frame: demo.first_frame,
            file: self.file,
            figures: statistics.iter().map(|feature| feature.figures(true)).collect(),
        });
        if self.total.is_empty() {
            self.total = statistics;
        } else {
            self.total.iter_mut().zip(&statistics).for_each(|(total, more)| total.merge(more));
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), DatasetError> {
        self.table.take().map_or(Ok(()), ParquetTable::finish)?;
        for (file, episodes) in self.episodes.chunks(EPISODES_PER_TABLE).enumerate() {
            write_episode_table(&self.dir, file, episodes)?;
        }
        let stats: Map<String, Value> = self.total.iter().map(|f| json_entry(&f.figures(true))).collect();
        Ok(files::write_json(&self.dir.join("meta/stats.json"), &stats)?)
    }
}

/// Entry of a feature in `stats.json`.
fn json_entry(figures: &FeatureFigures) -> (String, Value) {
    let named = figures.nested(NestedList::Number).into_iter();
    let all: Map<String, Value> = named.map(|(name, list)| (name.to_owned(), json!(list))).collect();
    (figures.name.to_owned(), Value::Object(all))
}

fn write_episode_table(dir: &Path, file: usize, episodes: &[EpisodeSummary]) -> Result<(), DatasetError> {
    let integers = |name: &str, number: &dyn Fn(&EpisodeSummary) -> usize| {
        let numbers = episodes.iter().map(|episode| number(episode) as i64).collect();
        (ParquetColumn::new(name, ColumnType::I64, &[]), ColumnValues::I64(numbers))
    };
    let prompts = episodes.iter().map(|episode| episode.prompt.clone()).collect();
    let mut all = vec![
        integers("episode_index", &|e| e.index),
        (ParquetColumn::new("tasks", ColumnType::Text, &[1]), ColumnValues::Text(prompts)),
        integers("length", &|e| e.steps),
        integers("data/chunk_index", &|e| e.file / CHUNK),
        integers("data/file_index", &|e| e.file % CHUNK),
        integers("dataset_from_index", &|e| e.first_frame),
        integers("dataset_to_index", &|e| e.first_frame + e.steps),
    ];
    for (at, feature) in episodes.first().map_or(&[][..], |first| &first.figures).iter().enumerate() {
        for (which, figure) in feature.figures.iter().enumerate() {
            let name = format!("stats/{}/{}", feature.name, figure.name);
            let column = ParquetColumn::new(name, ColumnType::F64, &feature.shape);
            let numbers = episodes.iter().flat_map(|e| e.figures[at].figures[which].values.iter().copied());
            all.push((column, ColumnValues::F64(numbers.collect())));
        }
        let counts = episodes.iter().map(|e| e.figures[at].steps as i64).collect();
        let name = format!("stats/{}/count", feature.name);
        all.push((ParquetColumn::new(name, ColumnType::I64, &[1]), ColumnValues::I64(counts)));
    }
    all.push(integers("meta/episodes/chunk_index", &|_| file / CHUNK));
    all.push(integers("meta/episodes/file_index", &|_| file % CHUNK));
    let (columns, values): (Vec<ParquetColumn>, Vec<ColumnValues>) = all.into_iter().unzip();
    let path = numbered_path(dir, "meta/episodes", file)?;
    let mut table = ParquetTable::create(path, &columns.into(), &[])?;
    table.append(episodes.len(), values)?;
    table.finish()
}
