//! Parquet files: columns of numbers, of nested lists of one shape, of text, and of PNG pictures as Hugging Face keeps them.

use std::{
    fmt::Write as _,
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

use crate::dataset::DatasetError;

/// What a column is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColumnType {
    /// A PNG file and its name.
    Picture,
    /// Single precision.
    F32,
    /// Double precision.
    F64,
    /// Whole numbers.
    I64,
    /// Text.
    Text,
}

/// A column: a value a row, or nested lists of one shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ParquetColumn {
    /// Name.
    pub name: String,
    /// Of what.
    pub kind: ColumnType,
    /// Lengths of the lists, the outermost first; empty for a value.
    pub shape: Vec<usize>,
}

/// EpisodeRows of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ColumnValues {
    /// PNG files and their names.
    Pictures(Vec<(Vec<u8>, String)>),
    /// Of [`ColumnType::F32`].
    F32(Vec<f32>),
    /// Of [`ColumnType::F64`].
    F64(Vec<f64>),
    /// Of [`ColumnType::I64`].
    I64(Vec<i64>),
    /// Of [`ColumnType::Text`].
    Text(Vec<String>),
}

impl ParquetColumn {
    /// A column.
    pub(super) fn new(name: impl Into<String>, kind: ColumnType, shape: &[usize]) -> Self {
        Self { name: name.into(), kind, shape: shape.to_vec() }
    }

    /// The column in Parquet's language of schemas. Everything may be null, as Arrow's writers have it, and nothing is.
    fn declared(&self) -> String {
        let mut text = match self.kind {
            ColumnType::Picture => {
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
    fn levels(&self, rows: usize) -> (Vec<i16>, Option<Vec<i16>>) {
        let depth = self.shape.len();
        let row: usize = self.shape.iter().product();
        let definition = if self.kind == ColumnType::Picture { 2 } else { 2 * depth as i16 + 1 };
        let definitions = vec![definition; rows * row];
        if depth == 0 {
            return (definitions, None);
        }
        // The outermost list that begins at a place of a row tells its level; the first place begins the row itself.
        let level = |place: usize| {
            let begins = |outer: usize| place.is_multiple_of(self.shape[outer + 1..].iter().product());
            let outer = (0..depth).find(|outer| begins(*outer)).unwrap_or(depth - 1);
            if place == 0 { 0 } else { outer as i16 + 1 }
        };
        let one: Vec<i16> = (0..row).map(level).collect();
        (definitions, Some(one.repeat(rows)))
    }
}

/// A file that is being written, one group of rows after the other.
pub(super) struct ParquetTable {
    writer: SerializedFileWriter<File>,
    columns: Arc<[ParquetColumn]>,
    path: PathBuf,
}

/// What went wrong with a file.
fn failed(path: &Path) -> impl Fn(ParquetError) -> DatasetError {
    move |error| match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(source) => DatasetError::io("write", path)(*source),
            Err(other) => DatasetError::content(path, "Parquet", other.to_string()),
        },
        other => DatasetError::content(path, "Parquet", other.to_string()),
    }
}

impl ParquetTable {
    /// InitialCondition a file with what programs are to know of it: `notes`, by name.
    ///
    /// # Errors
    /// The system refuses.
    pub(super) fn create(
        path: PathBuf,
        columns: &Arc<[ParquetColumn]>,
        notes: &[(&str, String)],
    ) -> Result<Self, DatasetError> {
        let mut schema = "message schema {".to_owned();
        for column in columns.iter() {
            // Writing into a string cannot fail.
            let _ = write!(schema, " {}", column.declared());
        }
        let schema = parse_message_type(&(schema + " }")).map_err(failed(&path))?;
        let notes = notes.iter().map(|(name, text)| KeyValue::new((*name).to_owned(), text.clone()));
        let mut properties = WriterProperties::builder()
            .set_created_by(format!("softvt {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata(Some(notes.collect()))
            // Pictures are compressed, and the numbers are few beside them.
            .set_dictionary_enabled(false)
            .set_offset_index_disabled(true)
            .set_statistics_enabled(EnabledStatistics::None);
        for column in
            columns.iter().filter(|column| column.kind == ColumnType::I64 && column.shape.is_empty())
        {
            // Readers skip episodes by them.
            let place = ColumnPath::new(vec![column.name.clone()]);
            properties = properties.set_column_statistics_enabled(place, EnabledStatistics::Chunk);
        }
        let file = File::create(&path).map_err(DatasetError::io("write", &path))?;
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()))
            .map_err(failed(&path))?;
        Ok(Self { writer, columns: columns.clone(), path })
    }

    /// Bytes of the file so far.
    pub(super) fn bytes(&self) -> usize {
        self.writer.bytes_written()
    }

    /// Adds a group of `rows` rows: the values of every column, in order.
    ///
    /// # Errors
    /// The system refuses.
    pub(super) fn append(&mut self, rows: usize, values: Vec<ColumnValues>) -> Result<(), DatasetError> {
        debug_assert_eq!(values.len(), self.columns.len());
        let added = group(&mut self.writer, &self.columns, rows, values);
        added.map_err(failed(&self.path))
    }

    /// Ends the file; it is on disk then.
    ///
    /// # Errors
    /// The system refuses.
    pub(super) fn finish(self) -> Result<(), DatasetError> {
        let file = self.writer.into_inner().map_err(failed(&self.path))?;
        file.sync_all().map_err(DatasetError::io("write", &self.path))
    }
}

fn group(
    writer: &mut SerializedFileWriter<File>,
    columns: &[ParquetColumn],
    rows: usize,
    values: Vec<ColumnValues>,
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for (column, values) in columns.iter().zip(values) {
        let levels = column.levels(rows);
        match values {
            ColumnValues::Pictures(pictures) => {
                let (files, names): (Vec<ByteArray>, Vec<ByteArray>) =
                    pictures.into_iter().map(|(file, name)| (file.into(), name.into_bytes().into())).unzip();
                leaf::<ByteArrayType>(&mut group, &files, &levels)?;
                leaf::<ByteArrayType>(&mut group, &names, &levels)?;
            }
            ColumnValues::F32(numbers) => leaf::<FloatType>(&mut group, &numbers, &levels)?,
            ColumnValues::F64(numbers) => leaf::<DoubleType>(&mut group, &numbers, &levels)?,
            ColumnValues::I64(numbers) => leaf::<Int64Type>(&mut group, &numbers, &levels)?,
            ColumnValues::Text(texts) => {
                let texts: Vec<ByteArray> = texts.into_iter().map(|text| text.into_bytes().into()).collect();
                leaf::<ByteArrayType>(&mut group, &texts, &levels)?;
            }
        }
    }
    group.close()?;
    Ok(())
}

fn leaf<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, File>,
    values: &[T::T],
    (definitions, repetitions): &(Vec<i16>, Option<Vec<i16>>),
) -> Result<(), ParquetError> {
    let missing = || ParquetError::General("more columns than the schema has".to_owned());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    column.typed::<T>().write_batch(values, Some(definitions), repetitions.as_deref())?;
    column.close()
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};

    use super::*;

    #[test]
    fn levels_say_where_each_list_begins() {
        let cube = ParquetColumn::new("x", ColumnType::F32, &[2, 2, 3]);
        let (definitions, repetitions) = cube.levels(2);
        assert_eq!(definitions, [7; 24]);
        let row = [0, 3, 3, 2, 3, 3, 1, 3, 3, 2, 3, 3];
        assert_eq!(repetitions, Some([row, row].concat()));
        assert_eq!(ParquetColumn::new("x", ColumnType::I64, &[]).levels(2), (vec![1, 1], None));
    }

    #[test]
    fn every_kind_of_column_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.parquet");
        let columns = [
            ParquetColumn::new("picture", ColumnType::Picture, &[]),
            ParquetColumn::new("a/b", ColumnType::F32, &[2, 1]),
            ParquetColumn::new("count", ColumnType::I64, &[]),
            ParquetColumn::new("figure", ColumnType::F64, &[1]),
            ParquetColumn::new("tasks", ColumnType::Text, &[1]),
        ];
        let mut table =
            ParquetTable::create(path.clone(), &columns.into(), &[("note", "what".to_owned())]).unwrap();
        for row in 0..2_i64 {
            let values = vec![
                ColumnValues::Pictures(vec![(vec![137, row as u8], "x.png".to_owned())]),
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

    #[test]
    fn a_full_disk_is_told_with_the_file() {
        // A device on which nothing ever fits; other systems have none.
        let full = Path::new("/dev/full");
        if !full.exists() {
            return;
        }
        let columns = [ParquetColumn::new("x", ColumnType::F64, &[1000])];
        let mut table = ParquetTable::create(full.to_owned(), &columns.into(), &[]).unwrap();
        let added = table.append(100, vec![ColumnValues::F64(vec![0.0; 100_000])]);
        let error = added.and_then(|()| table.finish()).unwrap_err().to_string();
        assert!(error.contains("cannot write /dev/full: No space left"), "{error}");
    }
}
