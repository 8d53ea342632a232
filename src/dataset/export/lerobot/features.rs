//! Columns of the rows: for LeRobot's `info.json`, for Hugging Face's `datasets`, and as table columns.

use parquet::file::metadata::KeyValue;
use serde_json::{Map, Value, json};

use super::{
    parquet_table::{ColumnType, ParquetColumn, TableSchema},
    version::LeRobotVersion,
};
use crate::export::features::{Content, Feature};

/// Index features of a row, in order: the last ones.
pub(super) const INDEX_FEATURES: [&str; 4] = ["frame_index", "episode_index", "index", "task_index"];

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    /// Its key in this version.
    pub name: &'static str,
    /// Type in LeRobot's terms.
    dtype: &'static str,
    shape: Vec<usize>,
    /// Names of its numbers or axes.
    names: Value,
}

/// All columns in order; those that LeRobot adds to every dataset come last.
pub(super) fn all(features: &[Feature], version: LeRobotVersion) -> Vec<Column> {
    let own = features.iter().filter_map(|feature| {
        let dtype = if matches!(feature.content, Content::Image(_)) { "image" } else { "float32" };
        let (shape, names) = (feature.shape.clone(), feature.components.clone());
        Some(Column { name: version.key(feature)?, dtype, shape, names })
    });
    let single = |name, dtype| Column { name, dtype, shape: vec![1], names: Value::Null };
    let numbered = INDEX_FEATURES.map(|name| single(name, "int64"));
    own.chain([single("timestamp", "float32")]).chain(numbered).collect()
}

impl Column {
    fn is_image(&self) -> bool {
        self.dtype == "image"
    }

    fn column(&self) -> ParquetColumn {
        let kind = match self.dtype {
            "image" => ColumnType::Image,
            "int64" => ColumnType::I64,
            _ => ColumnType::F32,
        };
        let single = self.is_image() || self.shape == [1];
        ParquetColumn::new(self.name, kind, if single { &[] } else { &self.shape })
    }

    /// Description for Hugging Face's `datasets`.
    fn hugging_face(&self) -> Value {
        let value = json!({ "dtype": self.dtype, "_type": "Value" });
        match self.shape[..] {
            _ if self.is_image() => json!({ "_type": "Image" }),
            [1] => value,
            [length] => json!({ "feature": value, "length": length, "_type": "Sequence" }),
            _ => {
                json!({ "shape": self.shape, "dtype": self.dtype, "_type": format!("Array{}D", self.shape.len()) })
            }
        }
    }
}

/// The `features` of `info.json`.
pub(super) fn info(features: &[Column]) -> Value {
    let entry =
        |f: &Column| (f.name.to_owned(), json!({ "dtype": f.dtype, "shape": f.shape, "names": f.names }));
    Value::Object(features.iter().map(entry).collect())
}

/// Schema of the tables of rows. Their metadata are those that `datasets` expects: without them, images
/// are read as bytes.
pub(super) fn schema(features: &[Column]) -> TableSchema {
    let known: Map<String, Value> = features.iter().map(|f| (f.name.to_owned(), f.hugging_face())).collect();
    let text = json!({ "info": { "features": known } }).to_string();
    TableSchema {
        columns: features.iter().map(Column::column).collect(),
        metadata: vec![KeyValue::new("huggingface".to_owned(), text)],
    }
}
