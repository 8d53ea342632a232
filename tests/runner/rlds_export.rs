//! Exports as RLDS: records have the numbers of a LeRobot export, files do not depend on threads, and invalid exports
//! are refused. `tests/dataset/rlds.py` reads every value.

use std::{fs, path::Path};

use serde_json::{Value, json};
use softvt::dataset::{
    OptionalStream,
    export::{self, ArmControl, ExportConfig, ExportFormat},
};

use crate::{
    dataset_recording::Recording,
    lerobot_export::{V21, config, export, field, numbers, project, rows},
    support::{Project, files},
};

/// The records of a file.
fn records(path: &Path) -> Vec<Vec<u8>> {
    let bytes = fs::read(path).expect("a file of records");
    let (mut records, mut rest) = (Vec::new(), &bytes[..]);
    while let Some((length, framed)) = rest.split_first_chunk::<8>() {
        let length = u64::from_le_bytes(*length) as usize;
        records.push(framed[4..4 + length].to_vec());
        rest = &framed[4 + length + 4..];
    }
    records
}

/// True if a record has exactly these numbers under a key: they follow the key and its tags and lengths.
fn holds(record: &[u8], key: &str, numbers: &[f32]) -> bool {
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let key = [&[key.len() as u8], key.as_bytes()].concat();
    let Some(at) = record.windows(key.len()).position(|window| window == key) else { return false };
    let value = &record[at + key.len()..];
    // Three tags, each with a length of up to five bytes; the last is that of the numbers.
    (6..=18).any(|start| value[start..].starts_with(&bytes) && ends_with_length(&value[..start], bytes.len()))
}

/// True if `prefix` ends with `length` as a varint.
fn ends_with_length(prefix: &[u8], mut length: usize) -> bool {
    let mut varint = Vec::new();
    while length >= 128 {
        varint.push(length as u8 | 128);
        length >>= 7;
    }
    varint.push(length as u8);
    prefix.ends_with(&varint)
}

fn feature(features: &Value, path: &[&str]) -> Value {
    let child = |found: &Value, name: &&str| match &found["sequence"]["feature"] {
        Value::Null => found["featuresDict"]["features"][name].clone(),
        steps => steps["featuresDict"]["features"][name].clone(),
    };
    path.iter().fold(features.clone(), |found, name| child(&found, name))
}

fn rlds(project: &Project, out: &str) -> ExportConfig {
    config(project, ExportFormat::Rlds, out)
}

#[test]
fn records_have_the_numbers_of_a_lerobot_export() {
    let project = project();
    let recording = Recording::new(project.run("x.lua"), 2, "data");
    recording
        .with(|options| options.streams = [OptionalStream::named("joint-torques").expect("a stream")].into())
        .record();
    let exported = export(&ExportConfig { threads: 1, ..rlds(&project, "a") });
    assert_eq!((exported.episodes, exported.tasks), (4, 2));
    export(&ExportConfig { threads: 3, ..rlds(&project, "b") });
    assert!(files(&project.path("a")) == files(&project.path("b")), "not the same bytes");
    export(&config(&project, V21, "rows"));
    let records = records(&project.path("a/softvt_one/1.0.0/softvt_one-train.tfrecord-00000-of-00001"));
    assert_eq!(records.len(), 4);
    for (index, record) in records.iter().enumerate() {
        let rows = rows(&project.path(&format!("rows/data/chunk-000/episode_{index:06}.parquet")));
        for (name, key) in [
            ("state", "steps/observation/state"),
            ("actions", "steps/action"),
            ("tactile_marker_motion", "steps/observation/tactile_marker_motion"),
            ("joint_torques", "steps/observation/joint_torques"),
        ] {
            let column: Vec<f32> = rows.iter().flat_map(|row| numbers(field(row, name))).collect();
            assert!(holds(record, key, &column), "{key} of episode {index}");
        }
        let last = [vec![0.0; rows.len() - 1], vec![1.0]].concat();
        assert!(holds(record, "steps/reward", &last), "episode {index}");
    }
    let info = project.json("a/softvt_one/1.0.0/dataset_info.json");
    assert_eq!((&info["name"], &info["version"]), (&"softvt_one".into(), &"1.0.0".into()));
    assert_eq!(info["splits"][0]["shardLengths"], json!(["4"]));
    let bytes: usize = records.iter().map(Vec::len).sum();
    assert_eq!(info["splits"][0]["numBytes"], bytes.to_string());
    assert!(project.text("a/README.md").contains("| `observation/joint_torques` |"));
}

#[test]
fn tasks_and_joint_positions_are_exported() {
    let project = project();
    Recording::new(project.run("x.lua"), 1, "data").record();
    let second = |config| ExportConfig { tasks: vec!["for".to_owned()], ..config };
    let joints = ExportConfig { control: ArmControl::Joints, ..rlds(&project, "a") };
    assert_eq!(export(&second(joints)).episodes, 1);
    export(&second(ExportConfig { control: ArmControl::Joints, ..config(&project, V21, "rows") }));
    let rows = rows(&project.path("rows/data/chunk-000/episode_000000.parquet"));
    let records = records(&project.path("a/softvt_one/1.0.0/softvt_one-train.tfrecord-00000-of-00001"));
    for (name, key) in [("state", "steps/observation/state"), ("actions", "steps/action")] {
        let column: Vec<f32> = rows.iter().flat_map(|row| numbers(field(row, name))).collect();
        assert!(column.len() == 8 * rows.len() && holds(&records[0], key, &column), "{key}");
    }
    let features = project.json("a/softvt_one/1.0.0/features.json");
    let shape = |path: &[&str]| feature(&features, path)["tensor"]["shape"]["dimensions"].clone();
    assert_eq!(shape(&["steps", "action"]), json!(["8"]));
    assert_eq!(shape(&["steps", "observation", "joint_state"]), json!(["7"]));
    assert_eq!(feature(&features, &["steps", "observation", "joint_torques"]), Value::Null);
    assert_eq!(project.json("a/softvt_one/1.0.0/softvt.json")["control"], "joints");
}

#[test]
fn invalid_exports_are_refused_and_leave_nothing() {
    let project = project();
    let record = |out: &str| Recording::new(project.run("x.lua").tasks(&[0]), 1, out);
    record("data").record();
    record("plain").with(|options| options.has_images = false).record();
    project.write("full/mine", b"mine");
    let refusal = |config: &ExportConfig| project.message(export::export(config, || false, |_, _| ()));
    let config = |data: &str, out: &str| ExportConfig { data: project.path(data), ..rlds(&project, out) };
    for (config, output) in [
        (config("data", "full"), "full: it holds mine; nothing was written"),
        (config("plain", "x"), "record them in the HDF5 files"),
        (ExportConfig { tasks: vec!["7".to_owned()], ..config("data", "x") }, "no task matches \"7\""),
    ] {
        let message = refusal(&config);
        assert!(message.contains(output), "{output}: {message}");
    }
    // A file that ends in the middle of a demonstration.
    let hdf5 = project.path("data/hdf5/one_task0_demo.hdf5");
    let whole = fs::read(&hdf5).expect("read");
    fs::write(&hdf5, &whole[..whole.len() / 2]).expect("written");
    let message = refusal(&config("data", "x"));
    assert!(message.contains("one_task0_demo.hdf5") && message.contains("cut short"), "{message}");
    assert!(!project.path("x").exists() && !project.path("x.part").exists());
    assert_eq!(files(&project.path("full")).len(), 1);
}
