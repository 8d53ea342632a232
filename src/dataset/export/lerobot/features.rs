//! Features of a row: for LeRobot's `info.json`, for Hugging Face's `datasets`, and as table columns.

use parquet::file::metadata::KeyValue;
use serde_json::{Map, Value, json};

use super::{
    parquet_table::{ColumnType, ParquetColumn, TableSchema},
    version::LeRobotVersion,
};
use crate::export::{
    ExportJob,
    demo_reader::MARKER_SHAPE,
    selection::{IMAGE_FEATURES, ImageSize},
};
use softvt_policy::profile::JOINT_NAMES;

/// Index features of a row, in order: the last ones.
pub(super) const INDEX_FEATURES: [&str; 4] = ["frame_index", "episode_index", "index", "task_index"];

/// A feature.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Feature {
    /// Its key in this version.
    pub name: &'static str,
    /// Type in LeRobot's terms.
    pub dtype: &'static str,
    /// Shape per row.
    pub shape: Vec<usize>,
    /// Names of its numbers or axes.
    names: Value,
}

/// All features in order; those that LeRobot adds to every dataset come last.
pub(super) fn all(job: &ExportJob<'_>, version: LeRobotVersion) -> Vec<Feature> {
    let control = job.config.control;
    let vector = [control.vector_length()];
    let feature = |name, dtype, shape: &[usize], names| Feature {
        name: version.key(name),
        dtype,
        shape: shape.to_vec(),
        names,
    };
    let images = IMAGE_FEATURES.into_iter().zip(job.selection.feature_sizes());
    let images = images.map(|(name, ImageSize { height, width })| {
        feature(name, "image", &[height, width, 3], json!(["height", "width", "channel"]))
    });
    let with = |last: &'static str| json!(control.motion_names().iter().chain([&last]).collect::<Vec<_>>());
    let own = [
        feature("state", "float32", &vector, with("finger")),
        feature("actions", "float32", &vector, with("closure")),
        feature("tactile_marker_motion", "float32", &MARKER_SHAPE, json!(["time", "marker", "xy"])),
    ];
    let torques = job
        .selection
        .has_joint_torques
        .then(|| feature("joint_torques", "float32", &[JOINT_NAMES.len()], json!(JOINT_NAMES)));
    let timestamp = feature("timestamp", "float32", &[1], Value::Null);
    let numbered = INDEX_FEATURES.map(|name| feature(name, "int64", &[1], Value::Null));
    images.chain(own).chain(torques).chain([timestamp]).chain(numbered).collect()
}

impl Feature {
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
pub(super) fn info(features: &[Feature]) -> Value {
    let entry =
        |f: &Feature| (f.name.to_owned(), json!({ "dtype": f.dtype, "shape": f.shape, "names": f.names }));
    Value::Object(features.iter().map(entry).collect())
}

/// Schema of the tables of rows. Their metadata are those that `datasets` expects: without them, images are read as
/// bytes.
pub(super) fn schema(features: &[Feature]) -> TableSchema {
    let known: Map<String, Value> = features.iter().map(|f| (f.name.to_owned(), f.hugging_face())).collect();
    let text = json!({ "info": { "features": known } }).to_string();
    TableSchema {
        columns: features.iter().map(Feature::column).collect(),
        metadata: vec![KeyValue::new("huggingface".to_owned(), text)],
    }
}
