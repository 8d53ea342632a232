//! Version 3.0: many episodes per table, one row group each, and tables about the episodes.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::{
    episode::{EpisodeData, LerobotEpisodeWriter},
    parquet_table::{ColumnType, ColumnValues, ParquetColumn, ParquetTable, TableSchema},
    statistics::{FeatureStatistics, Figure, NestedList},
    version::{CHUNK, MAX_TABLE_MB},
};
use crate::DatasetError;
use softvt_common::files;

/// Episodes per table about episodes: some 60 MB.
const EPISODES_PER_TABLE: usize = 10_000;

/// Path of the n-th file of a kind; its folder is created.
fn numbered_path(dir: &Path, kind: &str, file: usize) -> Result<PathBuf, DatasetError> {
    let path = dir.join(format!("{kind}/chunk-{:03}/file-{:03}.parquet", file / CHUNK, file % CHUNK));
    files::create_parent(&path)?;
    Ok(path)
}

/// Row of a table about episodes.
struct EpisodeSummary {
    index: usize,
    prompt: String,
    steps: usize,
    first_frame: usize,
    /// Number of the file that holds its rows.
    file: usize,
    figures: Vec<Vec<Figure>>,
}

/// Writes many episodes per table.
pub(super) struct SharedTableWriter {
    dir: PathBuf,
    schema: TableSchema,
    /// The table that is being written, and its number.
    table: Option<ParquetTable>,
    file: usize,
    episodes: Vec<EpisodeSummary>,
    total: Vec<FeatureStatistics>,
}

impl SharedTableWriter {
    /// `dir` is empty.
    pub(super) fn create(dir: &Path, schema: TableSchema) -> Result<Self, DatasetError> {
        files::create_folder(&dir.join("meta"))?;
        let dir = dir.to_owned();
        Ok(Self { dir, schema, table: None, file: 0, episodes: Vec::new(), total: Vec::new() })
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
                ParquetTable::create(numbered_path(&self.dir, "data", self.file)?, &self.schema)?
            }
        };
        Ok(self.table.insert(table))
    }

    /// Writes the table about `episodes`, which is the `file`-th.
    fn write_episode_table(&self, file: usize, episodes: &[EpisodeSummary]) -> Result<(), DatasetError> {
        let integers = |name: &str, shape: &[usize], number: &dyn Fn(&EpisodeSummary) -> usize| {
            let numbers = episodes.iter().map(|episode| number(episode) as i64).collect();
            (ParquetColumn::new(name, ColumnType::I64, shape), ColumnValues::I64(numbers))
        };
        let prompts = episodes.iter().map(|episode| episode.prompt.clone()).collect();
        let mut columns = vec![
            integers("episode_index", &[], &|e| e.index),
            (ParquetColumn::new("tasks", ColumnType::Text, &[1]), ColumnValues::Text(prompts)),
            integers("length", &[], &|e| e.steps),
            integers("data/chunk_index", &[], &|e| e.file / CHUNK),
            integers("data/file_index", &[], &|e| e.file % CHUNK),
            integers("dataset_from_index", &[], &|e| e.first_frame),
            integers("dataset_to_index", &[], &|e| e.first_frame + e.steps),
        ];
        for (at, FeatureStatistics { name, shape, .. }) in self.total.iter().enumerate() {
            for (which, figure) in episodes[0].figures[at].iter().enumerate() {
                let name = format!("stats/{name}/{}", figure.name);
                let values = episodes.iter().flat_map(|e| e.figures[at][which].values.iter().copied());
                let column = ParquetColumn::new(name, ColumnType::F64, shape);
                columns.push((column, ColumnValues::F64(values.collect())));
            }
            columns.push(integers(&format!("stats/{name}/count"), &[1], &|e| e.steps));
        }
        columns.push(integers("meta/episodes/chunk_index", &[], &|_| file / CHUNK));
        columns.push(integers("meta/episodes/file_index", &[], &|_| file % CHUNK));
        let path = numbered_path(&self.dir, "meta/episodes", file)?;
        ParquetTable::write(path, episodes.len(), columns, Vec::new())
    }
}

impl LerobotEpisodeWriter for SharedTableWriter {
    fn add(&mut self, episode: EpisodeData<'_>) -> Result<(), DatasetError> {
        let EpisodeData { index, demo, columns, statistics } = episode;
        let steps = demo.entry.num_samples;
        let image_bytes = |column: &ColumnValues| match column {
            ColumnValues::Images(images) => images.iter().map(|image| image.png.len()).sum(),
            _ => 0,
        };
        let bytes = columns.iter().map(image_bytes).sum();
        self.table(bytes)?.append(steps, columns)?;
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
            self.write_episode_table(file, episodes)?;
        }
        let mut stats = Map::new();
        for feature in &self.total {
            let figures = feature.nested(true, NestedList::Number).into_iter();
            let figures = figures.map(|(name, list)| (name.to_owned(), json!(list)));
            stats.insert(feature.name.to_owned(), Value::Object(figures.collect()));
        }
        Ok(files::write_json(&self.dir.join("meta/stats.json"), &stats)?)
    }
}
