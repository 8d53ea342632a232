//! Version 3.0: many episodes a table, a group of rows each, and tables about them.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde_json::{Map, Value, json};

use super::{
    Episode, FeatureSummary, Form, Values,
    features::{self, Feature},
    meta::{self, CHUNK},
    summary::{Figures, Nest},
    table::{Column, Kind, Table},
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
    columns: Arc<[Column]>,
    note: (&'static str, String),
    /// The table that is being written, and how many there were before it.
    table: Option<Table>,
    file: usize,
    told: Vec<Told>,
    whole: Vec<FeatureSummary>,
}

impl Writer {
    /// Begins in a folder that is empty.
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
    fn table(&mut self, bytes: usize) -> Result<&mut Table, DatasetError> {
        let table = match self.table.take() {
            Some(table) if table.bytes() + bytes <= TABLE_MB << 20 => table,
            full => {
                if let Some(full) = full {
                    full.finish()?;
                    self.file += 1;
                }
                let path = place(&self.dir, "data", self.file)?;
                Table::create(path, &self.columns, std::slice::from_ref(&self.note))?
            }
        };
        Ok(self.table.insert(table))
    }
}

/// What LeRobot calls the picture of a step.
fn picture(step: usize) -> String {
    format!("frame-{step:06}.png")
}

impl Form for Writer {
    fn add(&mut self, episode: Episode<'_>) -> Result<(), DatasetError> {
        let Episode { index, source, rows, summaries } = episode;
        let steps = rows.steps;
        let bytes = rows.pictures.iter().flatten().map(Vec::len).sum();
        let values = Episode::columns(rows, (index, source), picture);
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
        self.table.take().map_or(Ok(()), Table::finish)?;
        for (file, told) in self.told.chunks(TOLD).enumerate() {
            episodes(&self.dir, file, told)?;
        }
        let stats: Map<String, Value> = self.whole.iter().map(|s| stats(&s.figures(true))).collect();
        meta::json(&self.dir.join("meta/stats.json"), &Value::Object(stats))
    }
}

/// A feature in `stats.json`.
fn stats(figures: &Figures) -> (String, Value) {
    let named = figures.nested(Nest::Number).into_iter();
    let all: Map<String, Value> = named.map(|(name, nest)| (name.to_owned(), json!(nest))).collect();
    (figures.name.to_owned(), Value::Object(all))
}

/// Writes a table about episodes.
fn episodes(dir: &Path, file: usize, told: &[Told]) -> Result<(), DatasetError> {
    let whole = |name: &str, number: &dyn Fn(&Told) -> usize| {
        let numbers = told.iter().map(|t| number(t) as i64).collect();
        (Column::new(name, Kind::I64, &[]), Values::I64(numbers))
    };
    let prompts = told.iter().map(|t| t.prompt.clone()).collect();
    let mut all = vec![
        whole("episode_index", &|t| t.index),
        (Column::new("tasks", Kind::Text, &[1]), Values::Text(prompts)),
        whole("length", &|t| t.steps),
        whole("data/chunk_index", &|t| t.file / CHUNK),
        whole("data/file_index", &|t| t.file % CHUNK),
        whole("dataset_from_index", &|t| t.first),
        whole("dataset_to_index", &|t| t.first + t.steps),
    ];
    for (at, feature) in told.first().map_or(&[][..], |first| &first.figures).iter().enumerate() {
        for (which, (figure, _)) in feature.figures.iter().enumerate() {
            let column = Column::new(format!("stats/{}/{figure}", feature.name), Kind::F64, &feature.shape);
            let numbers = told.iter().flat_map(|t| t.figures[at].figures[which].1.iter().copied());
            all.push((column, Values::F64(numbers.collect())));
        }
        let counts = told.iter().map(|t| t.figures[at].steps as i64).collect();
        let name = format!("stats/{}/count", feature.name);
        all.push((Column::new(name, Kind::I64, &[1]), Values::I64(counts)));
    }
    all.push(whole("meta/episodes/chunk_index", &|_| file / CHUNK));
    all.push(whole("meta/episodes/file_index", &|_| file % CHUNK));
    let (columns, values): (Vec<Column>, Vec<Values>) = all.into_iter().unzip();
    let path = place(dir, "meta/episodes", file)?;
    let mut table = Table::create(path, &columns.into(), &[])?;
    table.append(told.len(), values)?;
    table.finish()
}
