//! The content of `features.json`: the message `Feature` of TensorFlow Datasets, whose 64-bit numbers are texts in
//! JSON.

use serde_json::{Map, Value, json};

use crate::export::{
    ExportJob,
    features::{self, Content, Feature},
};

pub(super) fn json(job: &ExportJob<'_>) -> Value {
    let steps = json!({
        "pythonClassName": class("dataset_feature.Dataset"),
        "sequence": { "feature": steps(job), "length": "-1" },
    });
    dictionary([("steps", steps), ("episode_metadata", episode_metadata())])
}

fn steps(job: &ExportJob<'_>) -> Value {
    let (actions, observed): (Vec<_>, Vec<_>) =
        features::all(job).into_iter().partition(|feature| feature.content == Content::Action);
    dictionary(
        [("observation", dictionary(observed.iter().map(|feature| (feature.name, described(feature)))))]
            .into_iter()
            .chain(actions.iter().map(|action| ("action", described(action))))
            .chain([
                ("discount", scalar("float32", "always 1")),
                ("reward", scalar("float32", "1 in the last step, else 0")),
                ("is_first", scalar("bool", "true in the first step")),
                ("is_last", scalar("bool", "true in the last step")),
                ("is_terminal", scalar("bool", "true in the last step, which reaches the goal")),
                ("language_instruction", text("prompt of the task")),
            ]),
    )
}

fn described(feature: &Feature) -> Value {
    match feature.content {
        Content::Image(_) => json!({
            "pythonClassName": class("image_feature.Image"),
            "image": { "shape": dimensions(&feature.shape), "dtype": "uint8", "encodingFormat": "png" },
            "description": feature.about,
        }),
        _ => json!({
            "pythonClassName": class("tensor_feature.Tensor"),
            "tensor": { "shape": dimensions(&feature.shape), "dtype": "float32", "encoding": "none" },
            "description": feature.about,
        }),
    }
}

fn episode_metadata() -> Value {
    dictionary([
        ("file_path", text("HDF5 file of the recording")),
        ("suite", text("name of the suite")),
        ("task_id", scalar("int64", "index of the task in the suite")),
        ("episode", scalar("int64", "index of the attempt in the split of demonstrations")),
        ("demo_id", scalar("int64", "index of the demonstration in the file")),
        ("asset_name", text("asset of the target")),
        ("success", scalar("bool", "safe: without a drop, within the deformation limit")),
    ])
}

fn class(name: &str) -> String {
    format!("tensorflow_datasets.core.features.{name}")
}

fn dictionary(entries: impl IntoIterator<Item = (&'static str, Value)>) -> Value {
    let features: Map<String, Value> =
        entries.into_iter().map(|(name, feature)| (name.to_owned(), feature)).collect();
    json!({
        "pythonClassName": class("features_dict.FeaturesDict"),
        "featuresDict": { "features": features },
    })
}

fn dimensions(shape: &[usize]) -> Value {
    json!({ "dimensions": shape.iter().map(usize::to_string).collect::<Vec<_>>() })
}

fn scalar(dtype: &str, about: &str) -> Value {
    json!({
        "pythonClassName": class("scalar.Scalar"),
        "tensor": { "shape": {}, "dtype": dtype, "encoding": "none" },
        "description": about,
    })
}

fn text(about: &str) -> Value {
    json!({ "pythonClassName": class("text_feature.Text"), "text": {}, "description": about })
}
