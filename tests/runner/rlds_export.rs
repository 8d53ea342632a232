//! Exports as RLDS: records have the numbers of a LeRobot export, and files do not depend on threads.
//! `tests/dataset/rlds.py` reads every value.

use std::{fs, path::Path};

use serde_json::{Value, json};
use softvt::dataset::export::{ArmControl, ExportConfig, ExportFormat};

use crate::{
    lerobot_export::{V21, config, export, field, numbers, recorded, rows},
    support::files,
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

#[test]
fn files_do_not_depend_on_threads() {
    let project = recorded();
    let exported = export(&ExportConfig { threads: 1, ..config(project, ExportFormat::Rlds, "rlds_a") });
    assert_eq!((exported.episodes, exported.tasks), (4, 2));
    export(&ExportConfig { threads: 3, ..config(project, ExportFormat::Rlds, "rlds_b") });
    assert!(files(&project.path("rlds_a")) == files(&project.path("rlds_b")), "not the same bytes");
    let records = records(&project.path("rlds_a/softvt_one/1.0.0/softvt_one-train.tfrecord-00000-of-00001"));
    assert_eq!(records.len(), 4);
    let info = project.json("rlds_a/softvt_one/1.0.0/dataset_info.json");
    assert_eq!((&info["name"], &info["version"]), (&"softvt_one".into(), &"1.0.0".into()));
    assert_eq!(info["splits"][0]["shardLengths"], json!(["4"]));
    let bytes: usize = records.iter().map(Vec::len).sum();
    assert_eq!(info["splits"][0]["numBytes"], bytes.to_string());
    assert!(project.text("rlds_a/README.md").contains("| `observation/joint_torques` |"));
}

#[test]
fn tasks_and_joint_positions_are_exported() {
    let project = recorded();
    let second = |format, out: &str| ExportConfig {
        tasks: vec!["for".to_owned()],
        control: ArmControl::Joints,
        ..config(project, format, out)
    };
    assert_eq!(export(&second(ExportFormat::Rlds, "rlds_joints")).episodes, 2);
    export(&second(V21, "rlds_joint_rows"));
    let rows = rows(&project.path("rlds_joint_rows/data/chunk-000/episode_000000.parquet"));
    let records =
        records(&project.path("rlds_joints/softvt_one/1.0.0/softvt_one-train.tfrecord-00000-of-00001"));
    for (name, key) in [("state", "steps/observation/state"), ("actions", "steps/action")] {
        let column: Vec<f32> = rows.iter().flat_map(|row| numbers(field(row, name))).collect();
        assert!(column.len() == 8 * rows.len() && holds(&records[0], key, &column), "{key}");
    }
    let features = project.json("rlds_joints/softvt_one/1.0.0/features.json");
    let shape = |path: &[&str]| feature(&features, path)["tensor"]["shape"]["dimensions"].clone();
    assert_eq!(shape(&["steps", "action"]), json!(["8"]));
    assert_eq!(shape(&["steps", "observation", "joint_state"]), json!(["7"]));
    assert_eq!(feature(&features, &["steps", "observation", "joint_positions"]), Value::Null);
    assert_eq!(project.json("rlds_joints/softvt_one/1.0.0/softvt.json")["control"], "joints");
}
