//! What a row holds, in LeRobot's words, in those of Hugging Face's `datasets`, and as columns of a table.

use serde_json::{Map, Value, json};

use super::parquet_table::{ColumnType, ParquetColumn};
use crate::sensing::tactile::MARKER_COUNT;

/// Pictures of a row, in order.
pub(super) const PICTURES: [&str; 3] = ["image", "wrist_image", "tactile_image"];
/// Numbers of the state, and of an action.
pub(super) const STATE: usize = 7;
/// Shape of the markers of a row: initial places, and those of the step before and of this one; both fingers; x and y.
pub(super) const MARKER_SHAPE: [usize; 3] = [3, 2 * MARKER_COUNT, 2];

/// Names that a row's numbers have besides.
const POSE: [&str; 6] = ["x", "y", "z", "axis_angle_x", "axis_angle_y", "axis_angle_z"];

/// One of the features.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Feature {
    /// Its key.
    pub name: &'static str,
    /// LeRobot's word for its kind.
    pub dtype: &'static str,
    /// Shape of a row.
    pub shape: Vec<usize>,
    /// Names of its numbers, or of its axes.
    names: Value,
}

/// All of them in order, those that LeRobot adds to every data set last; `sizes` are height and width of both cameras.
pub(super) fn all(sizes: [[usize; 2]; 2]) -> Vec<Feature> {
    let feature = |name, dtype, shape: &[usize], names| Feature { name, dtype, shape: shape.to_vec(), names };
    let mosaic = [224, 224];
    let pictures = PICTURES.into_iter().zip([sizes[0], sizes[1], mosaic]);
    let pictures = pictures.map(|(name, [height, width])| {
        feature(name, "image", &[height, width, 3], json!(["height", "width", "channel"]))
    });
    let with = |last: &'static str| json!(POSE.iter().chain([&last]).collect::<Vec<_>>());
    let own = [
        feature("state", "float32", &[STATE], with("finger")),
        feature("actions", "float32", &[STATE], with("closure")),
        feature("tactile_marker_motion", "float32", &MARKER_SHAPE, json!(["time", "marker", "xy"])),
        feature("timestamp", "float32", &[1], Value::Null),
    ];
    let numbered = ["frame_index", "episode_index", "index", "task_index"]
        .map(|name| feature(name, "int64", &[1], Value::Null));
    pictures.chain(own).chain(numbered).collect()
}

impl Feature {
    fn is_picture(&self) -> bool {
        self.dtype == "image"
    }

    /// The column that holds it.
    pub(super) fn column(&self) -> ParquetColumn {
        let kind = match self.dtype {
            "image" => ColumnType::Picture,
            "int64" => ColumnType::I64,
            _ => ColumnType::F32,
        };
        let single = self.is_picture() || self.shape == [1];
        ParquetColumn::new(self.name, kind, if single { &[] } else { &self.shape })
    }

    /// What Hugging Face's `datasets` calls it.
    fn hugging_face(&self) -> Value {
        let value = json!({ "dtype": self.dtype, "_type": "Value" });
        match self.shape[..] {
            _ if self.is_picture() => json!({ "_type": "Image" }),
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

/// What `datasets` wants to find in a table: without it pictures come as bytes.
pub(super) fn note(features: &[Feature]) -> (&'static str, String) {
    let known: Map<String, Value> = features.iter().map(|f| (f.name.to_owned(), f.hugging_face())).collect();
    ("huggingface", json!({ "info": { "features": known } }).to_string())
}
