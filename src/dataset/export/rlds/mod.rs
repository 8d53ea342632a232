//! Datasets in RLDS (Ramos et al. 2021), the format of Open X-Embodiment: one record per episode, in TFRecord files
//! that TensorFlow Datasets reads with `builder_from_directory`. Keys are those of the LIBERO data that OpenVLA was
//! trained on.

mod episode;
mod example;
mod features;
mod tfrecord;

use std::collections::BTreeSet;

use serde_json::{Value, json};

use self::tfrecord::{ShardWriter, Split};
use super::{
    ExportJob,
    description::{self, FormatText},
    features::{Content, Feature},
};
use crate::DatasetError;
use softvt_common::files;

/// Version of a dataset, the name of its folder: that of the keys and of their meaning.
const VERSION: &str = "1.0.0";
/// Largest file of records, MB of 2²⁰ bytes, unless a single episode is larger.
const MAX_SHARD_MB: usize = 200;

/// Writes all files of a dataset. `dataset_info.json` is last: TensorFlow Datasets opens nothing without it.
pub(super) fn write(
    job: &ExportJob<'_>,
    on_episode: &mut dyn FnMut(usize, &str),
) -> Result<(), DatasetError> {
    let name = dataset_name(&job.selection.demos.iter().map(|demo| &*demo.entry.suite).collect());
    let dir = job.dir.join(&name).join(VERSION);
    files::create_folder(&dir)?;
    let mut writer = ShardWriter::new(dir.clone(), format!("{name}-train.tfrecord"), MAX_SHARD_MB << 20);
    job.for_each_episode(|_, demo| episode::read(job, demo), |record| Ok(writer.add(&record)?), on_episode)?;
    let split = writer.finish()?;
    files::write_json(&dir.join("features.json"), &features::json(job))?;
    files::write_json(&dir.join("softvt.json"), &description::encoding(job))?;
    files::replace(&job.dir.join("README.md"), readme(job, &name))?;
    Ok(files::write_json(&dir.join("dataset_info.json"), &info(&name, &split))?)
}

/// Name of the dataset: `softvt_` and that of the suite, or `softvt` for several suites. TensorFlow Datasets takes
/// lower-case letters, digits and underscores.
fn dataset_name(suites: &BTreeSet<&str>) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
    match suites.first() {
        Some(suite) if suites.len() == 1 => {
            format!("softvt_{}", suite.chars().map(letter).collect::<String>())
        }
        _ => "softvt".to_owned(),
    }
}

/// The content of `dataset_info.json`: the message `DatasetInfo` of TensorFlow Datasets, whose 64-bit numbers
/// are texts in JSON.
fn info(name: &str, split: &Split) -> Value {
    let lengths: Vec<String> = split.shard_lengths.iter().map(usize::to_string).collect();
    json!({
        "name": name,
        "version": VERSION,
        "description": format!(
            "Demonstrations of soft-object manipulation in simulation; exported by softvt {}.",
            env!("CARGO_PKG_VERSION")
        ),
        "fileFormat": "tfrecord",
        "splits": [{
            "name": "train",
            "filepathTemplate": "{DATASET}-{SPLIT}.{FILEFORMAT}-{SHARD_X_OF_Y}",
            "shardLengths": lengths,
            "numBytes": split.bytes.to_string(),
        }],
    })
}

fn readme(job: &ExportJob<'_>, name: &str) -> String {
    let files = format!(
        "`tfds.builder_from_directory(\"{name}/{VERSION}\")` of TensorFlow Datasets opens it. `softvt.json` beside the \
         records states the control ({}) and the grip code ({}); `episode_metadata` names the demonstration of each \
         episode.",
        job.config.control.name(),
        job.selection.gripper.name(),
    );
    description::readme(
        job,
        &FormatText {
            hub: "tags:\n- RLDS\n",
            name: "RLDS",
            key: |feature: &Feature| {
                Some(match feature.content {
                    Content::Action => "action".to_owned(),
                    _ => format!("observation/{}", feature.name),
                })
            },
            files,
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dataset_is_named_after_its_suite() {
        assert_eq!(dataset_name(&["object_soft"].into()), "softvt_object_soft");
        assert_eq!(dataset_name(&["Käse-2"].into()), "softvt_k_se_2");
        assert_eq!(dataset_name(&["one", "two"].into()), "softvt");
    }
}
