//! Parquet files with columns of numbers, nested lists of fixed shape, text, and PNG images in Hugging Face's form.

use std::{
    fs::File,
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use parquet::{
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::{EnabledStatistics, WriterProperties},
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::{parser::parse_message_type, types::ColumnPath},
};

use crate::DatasetError;
use softvt_common::files::FileError;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColumnType {
    /// A PNG file and its name.
    Image,
    F32,
    F64,
    I64,
    Text,
}

/// A column with one value per row, or nested lists of fixed shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ParquetColumn {
    pub name: String,
    pub column_type: ColumnType,
    /// Lengths of the lists, outermost first; empty for single values.
    pub shape: Vec<usize>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct EmbeddedImage {
    pub png: Vec<u8>,
    pub name: String,
}

#[derive(Clone)]
pub(super) struct TableSchema {
    pub columns: Arc<[ParquetColumn]>,
    pub metadata: Vec<KeyValue>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum ColumnValues {
    Images(Vec<EmbeddedImage>),
    F32(Vec<f32>),
    F64(Vec<f64>),
    I64(Vec<i64>),
    Text(Vec<String>),
}

/// Definition and repetition levels of the values of a column.
#[derive(Debug, PartialEq)]
struct DremelLevels {
    definitions: Vec<i16>,
    repetitions: Option<Vec<i16>>,
}

impl ParquetColumn {
    pub(super) fn new(name: impl Into<String>, column_type: ColumnType, shape: &[usize]) -> Self {
        Self { name: name.into(), column_type, shape: shape.to_vec() }
    }

    /// Declaration in Parquet's schema language. All values are optional, as Arrow's writers declare
    /// them; none is null.
    fn declaration(&self) -> String {
        let mut text = match self.column_type {
            ColumnType::Image => {
                "optional group {} { optional binary bytes; optional binary path (STRING); }"
            }
            ColumnType::F32 => "optional float {};",
            ColumnType::F64 => "optional double {};",
            ColumnType::I64 => "optional int64 {};",
            ColumnType::Text => "optional binary {} (STRING);",
        }
        .to_owned();
        for _ in &self.shape {
            let inner = text.replacen("{}", "element", 1);
            text = format!("optional group {{}} (LIST) {{ repeated group list {{ {inner} }} }}");
        }
        text.replacen("{}", &self.name, 1)
    }

    /// Definition and repetition levels (Melnik et al. 2010) of `rows` rows.
    fn levels(&self, rows: usize) -> DremelLevels {
        let depth = self.shape.len();
        let row: usize = self.shape.iter().product();
        let definition = if self.column_type == ColumnType::Image { 2 } else { 2 * depth as i16 + 1 };
        let definitions = vec![definition; rows * row];
        if depth == 0 {
            return DremelLevels { definitions, repetitions: None };
        }
        // The level of a value is that of the outermost list it begins; the first value begins the row itself.
        let level = |position: usize| {
            let begins = |outer: usize| position.is_multiple_of(self.shape[outer + 1..].iter().product());
            let outer = (0..depth).find(|outer| begins(*outer)).unwrap_or(depth - 1);
            if position == 0 { 0 } else { outer as i16 + 1 }
        };
        let one: Vec<i16> = (0..row).map(level).collect();
        DremelLevels { definitions, repetitions: Some(one.repeat(rows)) }
    }
}

/// A file that is being written, one row group at a time.
pub(super) struct ParquetTable {
    writer: SerializedFileWriter<File>,
    columns: Arc<[ParquetColumn]>,
    path: PathBuf,
}

/// Converts an error about `path`, for `map_err`.
fn failed(path: &Path) -> impl Fn(ParquetError) -> DatasetError {
    move |error| match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(source) => FileError::io("write", path)(*source).into(),
            Err(other) => DatasetError::content(path, "Parquet", other.to_string()),
        },
        other => DatasetError::content(path, "Parquet", other.to_string()),
    }
}

impl ParquetTable {
    /// Writes a complete file of `rows` rows with the given columns.
    pub(super) fn write(
        path: PathBuf,
        rows: usize,
        columns: Vec<(ParquetColumn, ColumnValues)>,
        metadata: Vec<KeyValue>,
    ) -> Result<(), DatasetError> {
        let (columns, values): (Vec<ParquetColumn>, Vec<ColumnValues>) = columns.into_iter().unzip();
        let mut table = Self::create(path, &TableSchema { columns: columns.into(), metadata })?;
        table.append(rows, values)?;
        table.finish()
    }

    pub(super) fn create(path: PathBuf, schema: &TableSchema) -> Result<Self, DatasetError> {
        let TableSchema { columns, metadata } = schema;
        let declarations: Vec<String> = columns.iter().map(ParquetColumn::declaration).collect();
        let message = format!("message schema {{ {} }}", declarations.join(" "));
        let schema = parse_message_type(&message).map_err(failed(&path))?;
        let mut properties = WriterProperties::builder()
            .set_created_by(format!("softvt {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata(Some(metadata.clone()))
            // Images are compressed already and make up most of the file.
            .set_dictionary_enabled(false)
            .set_offset_index_disabled(true)
            .set_statistics_enabled(EnabledStatistics::None);
        let is_index =
            |column: &&ParquetColumn| column.column_type == ColumnType::I64 && column.shape.is_empty();
        for column in columns.iter().filter(is_index) {
            // Readers use these statistics to skip episodes.
            let place = ColumnPath::new(vec![column.name.clone()]);
            properties = properties.set_column_statistics_enabled(place, EnabledStatistics::Chunk);
        }
        let file = File::create(&path).map_err(FileError::io("write", &path))?;
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()))
            .map_err(failed(&path))?;
        Ok(Self { writer, columns: columns.clone(), path })
    }

    pub(super) fn bytes(&self) -> usize {
        self.writer.bytes_written()
    }

    /// Appends a row group of `rows` rows with the values of every column, in order.
    pub(super) fn append(&mut self, rows: usize, values: Vec<ColumnValues>) -> Result<(), DatasetError> {
        debug_assert_eq!(values.len(), self.columns.len());
        let added = append_row_group(&mut self.writer, &self.columns, rows, values);
        added.map_err(failed(&self.path))
    }

    /// Completes and syncs the file.
    pub(super) fn finish(self) -> Result<(), DatasetError> {
        let file = self.writer.into_inner().map_err(failed(&self.path))?;
        Ok(file.sync_all().map_err(FileError::io("write", &self.path))?)
    }
}

fn append_row_group(
    writer: &mut SerializedFileWriter<File>,
    columns: &[ParquetColumn],
    rows: usize,
    values: Vec<ColumnValues>,
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for (column, values) in columns.iter().zip(values) {
        let levels = column.levels(rows);
        match values {
            ColumnValues::Images(images) => {
                let (files, names): (Vec<ByteArray>, Vec<ByteArray>) = images
                    .into_iter()
                    .map(|image| (image.png.into(), image.name.into_bytes().into()))
                    .unzip();
                write_leaf::<ByteArrayType>(&mut group, &files, &levels)?;
                write_leaf::<ByteArrayType>(&mut group, &names, &levels)?;
            }
            ColumnValues::F32(numbers) => write_leaf::<FloatType>(&mut group, &numbers, &levels)?,
            ColumnValues::F64(numbers) => write_leaf::<DoubleType>(&mut group, &numbers, &levels)?,
            ColumnValues::I64(numbers) => write_leaf::<Int64Type>(&mut group, &numbers, &levels)?,
            ColumnValues::Text(texts) => {
                let texts: Vec<ByteArray> = texts.into_iter().map(|text| text.into_bytes().into()).collect();
                write_leaf::<ByteArrayType>(&mut group, &texts, &levels)?;
            }
        }
    }
    group.close()?;
    Ok(())
}

fn write_leaf<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, File>,
    values: &[T::T],
    levels: &DremelLevels,
) -> Result<(), ParquetError> {
    let missing = || ParquetError::General("more columns than the schema has".to_owned());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    column.typed::<T>().write_batch(values, Some(&levels.definitions), levels.repetitions.as_deref())?;
    column.close()
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};

    use super::*;

    #[test]
    fn levels_mark_the_beginnings_of_lists() {
        let cube = ParquetColumn::new("x", ColumnType::F32, &[2, 2, 3]);
        let DremelLevels { definitions, repetitions } = cube.levels(2);
        assert_eq!(definitions, [7; 24]);
        let row = [0, 3, 3, 2, 3, 3, 1, 3, 3, 2, 3, 3];
        assert_eq!(repetitions, Some([row, row].concat()));
        assert_eq!(ParquetColumn::new("x", ColumnType::I64, &[]).levels(2).repetitions, None);
    }

    #[test]
    fn every_type_of_column_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.parquet");
        let columns = [
            ParquetColumn::new("image", ColumnType::Image, &[]),
            ParquetColumn::new("a/b", ColumnType::F32, &[2, 1]),
            ParquetColumn::new("count", ColumnType::I64, &[]),
            ParquetColumn::new("figure", ColumnType::F64, &[1]),
            ParquetColumn::new("tasks", ColumnType::Text, &[1]),
        ];
        let metadata = vec![KeyValue::new("note".to_owned(), "what".to_owned())];
        let schema = TableSchema { columns: columns.into(), metadata };
        let mut table = ParquetTable::create(path.clone(), &schema).unwrap();
        for row in 0..2_i64 {
            let values = vec![
                ColumnValues::Images(vec![EmbeddedImage {
                    png: vec![137, row as u8],
                    name: "x.png".to_owned(),
                }]),
                ColumnValues::F32(vec![0.5, row as f32]),
                ColumnValues::I64(vec![row]),
                ColumnValues::F64(vec![0.1]),
                ColumnValues::Text(vec!["put ü".to_owned()]),
            ];
            table.append(1, values).unwrap();
        }
        assert!(table.bytes() > 100);
        table.finish().unwrap();
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        assert_eq!(reader.num_row_groups(), 2);
        let notes = reader.metadata().file_metadata().key_value_metadata().unwrap();
        assert_eq!(notes[0], KeyValue::new("note".to_owned(), "what".to_owned()));
        let rows: Vec<String> =
            reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).collect();
        assert!(
            rows[1].contains("a/b: [[0.5], [1.0]], count: 1, figure: [0.1], tasks: [\"put ü\"]"),
            "{rows:?}"
        );
    }
}
