//! LeRobotVersion 3.0: many episodes a table, a group of rows each, and tables about them.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde_json::{Map, Value, json};

use super::{
    ColumnValues, ExportedEpisode, FeatureStatistics, FormatWriter,
    features::{self, Feature},
    meta::{self, CHUNK},
    parquet_table::{ColumnType, ParquetColumn, ParquetTable},
    statistics::{Figures, NestedList},
};
use crate::{dataset::DatasetError, files};

/// Where a table is, in Python's words.
pub(super) const DATA_PATH: &str = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet";
/// A table ends before it is larger, MB of 2²⁰ bytes, unless one episode alone is.
pub(super) const TABLE_MB: usize = 100;
/// Episodes in a table about them: some 60 MB.
const TOLD: usize = 10_000;

/// Makes the folder of the n-th file of a kind, and says where the file goes.
fn place(dir: &Path, kind: &str, file: usize) -> Result<PathBuf, DatasetError> {
    let folder = dir.join(format!("{kind}/chunk-{:03}", file / CHUNK));
    files::create_folder(&folder)?;
    Ok(folder.join(format!("file-{:03}.parquet", file % CHUNK)))
}

/// What is told of an episode.
struct Told {
    index: usize,
    prompt: String,
    steps: usize,
    first: usize,
    /// File of its rows.
    file: usize,
    figures: Vec<Figures>,
}

/// Writes it.
pub(super) struct Writer {
    dir: PathBuf,
    columns: Arc<[ParquetColumn]>,
    note: (&'static str, String),
    /// The table that is being written, and how many there were before it.
    table: Option<ParquetTable>,
    file: usize,
    told: Vec<Told>,
    whole: Vec<FeatureStatistics>,
}

impl Writer {
    /// InitialCondition in a folder that is empty.
    pub(super) fn begin(dir: &Path, features: &[Feature]) -> Result<Self, DatasetError> {
        files::create_folder(&dir.join("meta"))?;
        Ok(Self {
            dir: dir.to_owned(),
            columns: features.iter().map(Feature::column).collect(),
            note: features::note(features),
            table: None,
            file: 0,
            told: Vec::new(),
            whole: Vec::new(),
        })
    }

    /// The table that takes `bytes` more.
    fn table(&mut self, bytes: usize) -> Result<&mut ParquetTable, DatasetError> {
        let table = match self.table.take() {
            Some(table) if table.bytes() + bytes <= TABLE_MB << 20 => table,
            full => {
                if let Some(full) = full {
                    full.finish()?;
                    self.file += 1;
                }
                let path = place(&self.dir, "data", self.file)?;
                ParquetTable::create(path, &self.columns, std::slice::from_ref(&self.note))?
            }
        };
        Ok(self.table.insert(table))
    }
}

/// What LeRobot calls the picture of a step.
fn picture(step: usize) -> String {
    format!("frame-{step:06}.png")
}

impl FormatWriter for Writer {
    fn add(&mut self, episode: ExportedEpisode<'_>) -> Result<(), DatasetError> {
        let ExportedEpisode { index, source, rows, summaries } = episode;
        let steps = rows.steps;
        let bytes = rows.pictures.iter().flatten().map(Vec::len).sum();
        let values = ExportedEpisode::columns(rows, (index, source), picture);
        self.table(bytes)?.append(steps, values)?;
        self.told.push(Told {
            index,
            prompt: source.entry.language.clone(),
            steps,
            first: source.first,
            file: self.file,
            figures: summaries.iter().map(|s| s.figures(true)).collect(),
        });
        if self.whole.is_empty() {
            self.whole = summaries;
        } else {
            self.whole.iter_mut().zip(&summaries).for_each(|(whole, more)| whole.merge(more));
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), DatasetError> {
        self.table.take().map_or(Ok(()), ParquetTable::finish)?;
        for (file, told) in self.told.chunks(TOLD).enumerate() {
            episodes(&self.dir, file, told)?;
        }
        let stats: Map<String, Value> = self.whole.iter().map(|s| stats(&s.figures(true))).collect();
        meta::json(&self.dir.join("meta/stats.json"), &Value::Object(stats))
    }
}

/// A feature in `stats.json`.
fn stats(figures: &Figures) -> (String, Value) {
    let named = figures.nested(NestedList::Number).into_iter();
    let all: Map<String, Value> = named.map(|(name, nest)| (name.to_owned(), json!(nest))).collect();
    (figures.name.to_owned(), Value::Object(all))
}

/// Writes a table about episodes.
fn episodes(dir: &Path, file: usize, told: &[Told]) -> Result<(), DatasetError> {
    let whole = |name: &str, number: &dyn Fn(&Told) -> usize| {
        let numbers = told.iter().map(|t| number(t) as i64).collect();
        (ParquetColumn::new(name, ColumnType::I64, &[]), ColumnValues::I64(numbers))
    };
    let prompts = told.iter().map(|t| t.prompt.clone()).collect();
    let mut all = vec![
        whole("episode_index", &|t| t.index),
        (ParquetColumn::new("tasks", ColumnType::Text, &[1]), ColumnValues::Text(prompts)),
        whole("length", &|t| t.steps),
        whole("data/chunk_index", &|t| t.file / CHUNK),
        whole("data/file_index", &|t| t.file % CHUNK),
        whole("dataset_from_index", &|t| t.first),
        whole("dataset_to_index", &|t| t.first + t.steps),
    ];
    for (at, feature) in told.first().map_or(&[][..], |first| &first.figures).iter().enumerate() {
        for (which, (figure, _)) in feature.figures.iter().enumerate() {
            let column = ParquetColumn::new(
                format!("stats/{}/{figure}", feature.name),
                ColumnType::F64,
                &feature.shape,
            );
            let numbers = told.iter().flat_map(|t| t.figures[at].figures[which].1.iter().copied());
            all.push((column, ColumnValues::F64(numbers.collect())));
        }
        let counts = told.iter().map(|t| t.figures[at].steps as i64).collect();
        let name = format!("stats/{}/count", feature.name);
        all.push((ParquetColumn::new(name, ColumnType::I64, &[1]), ColumnValues::I64(counts)));
    }
    all.push(whole("meta/episodes/chunk_index", &|_| file / CHUNK));
    all.push(whole("meta/episodes/file_index", &|_| file % CHUNK));
    let (columns, values): (Vec<ParquetColumn>, Vec<ColumnValues>) = all.into_iter().unzip();
    let path = place(dir, "meta/episodes", file)?;
    let mut table = ParquetTable::create(path, &columns.into(), &[])?;
    table.append(told.len(), values)?;
    table.finish()
}
