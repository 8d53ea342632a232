//! Files with one error each, and the problems found in them.

use std::{f64::consts::PI, fs, path::PathBuf};

use rust_hdf5::H5File;
use serde_json::{Value, json};

use super::*;
use crate::{
    DataStream, Demonstration, StreamValues,
    hdf5::write_file,
    merge_parts,
    streams::{COMMANDED_ROTATIONS, StreamSpec, actions_in},
};
use softvt_geometry::Vec3;
use softvt_policy::{Action, NumberType, profile::GripCode};

const STEPS: usize = 9;

fn stream(name: &str, number_type: NumberType, row_shape: &[usize], numbers: Vec<f64>) -> DataStream {
    let (values, row_shape) = (StreamValues::new(number_type, numbers), row_shape.to_vec());
    DataStream { name: name.to_owned(), row_shape, values, attributes: Vec::new() }
}

/// A demonstration whose tool turns.
fn demonstration(salt: f64) -> Demonstration {
    let numbers = |spec: &StreamSpec, step: usize| -> Vec<f64> {
        match spec.path.starts_with("actions") && spec.row == [Some(7)] {
            true => vec![0.5 + salt, 0.0, 0.3, 3.0 + 0.05 * step as f64, 0.0, 0.0, 0.0],
            false => vec![0.0; spec.row.iter().flatten().product()],
        }
    };
    let of = |spec: &StreamSpec| {
        let row_shape: Vec<usize> = spec.row.iter().flatten().copied().collect();
        let numbers = (0..STEPS).flat_map(|step| numbers(spec, step)).collect();
        stream(spec.path, spec.number_type, &row_shape, numbers)
    };
    let required = streams::all().into_iter().filter(|spec| spec.presence == Presence::Always);
    let nodes = (0..STEPS * 210_000).map(|i| (i as f64 * 1e-4).sin()).collect();
    let nodes =
        stream("privileged/states/deformable_object/bun/nodal_pos_w", NumberType::F32, &[70_000, 3], nodes);
    let mut contact = stream("privileged/contact", NumberType::U8, &[2], vec![1.0; 2 * STEPS]);
    contact.attributes.push(("meaning".to_owned(), "touching".to_owned()));
    let mut record: softvt_runs::record::EpisodeRecord =
        serde_json::from_str(include_str!("../../../tests/data/episode_record.json"))
            .expect("a valid record");
    record.stats.steps = STEPS as u32;
    Demonstration { record, streams: required.map(|spec| of(&spec)).chain([nodes, contact]).collect() }
}

fn write_as(
    demonstration: &Demonstration,
    name: &str,
    environment: &Value,
    [total, demos]: [usize; 2],
) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write_file(&path, environment, total, demos, |writer| {
        writer.write_attributes(0, &demonstration.record)?;
        demonstration.streams.iter().try_for_each(|stream| writer.write_stream(0, STEPS, stream))
    })
    .unwrap();
    (folder, path)
}

fn write(demonstration: &Demonstration, name: &str) -> (tempfile::TempDir, PathBuf) {
    write_as(demonstration, name, &json!({ "env_name": "softvt" }), [STEPS, 1])
}

fn named<'a>(streams: &'a mut [DataStream], name: &str) -> &'a mut DataStream {
    streams.iter_mut().find(|stream| stream.name == name).expect("a stream")
}

fn numbers<'a>(streams: &'a mut [DataStream], name: &str) -> &'a mut Vec<f64> {
    let StreamValues::F64(numbers) = &mut named(streams, name).values else { panic!("{name} is of doubles") };
    numbers
}

/// The problems of a file whose streams `change` has damaged before they were written.
fn problems(change: impl Fn(&mut Vec<DataStream>)) -> String {
    let mut demonstration = demonstration(0.0);
    change(&mut demonstration.streams);
    let (_folder, path) = write(&demonstration, "task.hdf5");
    let found = file(&path).unwrap().problems;
    assert!(found.iter().all(|line| line.contains("task.hdf5: /data/demo_0/")), "{found:?}");
    found.join("\n")
}

#[test]
fn demonstrations_read_from_a_merged_file_are_identical() {
    let both = [demonstration(0.0), demonstration(1e-9)];
    let parts = both.each_ref().map(|demonstration| write(demonstration, "part.hdf5"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hdf5/task.hdf5");
    let environment = json!({ "env_name": "softvt", "env_kwargs": { "seed": 7 } });
    merge_parts(&parts.each_ref().map(|(_, path)| path.clone()), &path, &environment).unwrap();
    let read = TaskFile::open(&path).unwrap();
    assert_eq!((&read.demos[..], read.environment().unwrap()), (&[0, 1][..], environment));
    for (demo, demonstration) in both.into_iter().enumerate() {
        let in_order = |mut demonstration: Demonstration| {
            demonstration.streams.sort_by(|a, b| a.name.cmp(&b.name));
            demonstration
        };
        assert_eq!(in_order(read.read(demo).unwrap()), in_order(demonstration));
    }
    assert!(read.actions(2).unwrap_err().to_string().contains("there is no demo_2; there are 2"));
    let report = file(&path).unwrap();
    assert_eq!(report.problems, [""; 0]);
    assert_eq!((report.demos, report.steps), (2, 2 * STEPS));
}

#[test]
fn streams_that_are_missing_or_short_are_named() {
    let joints = "obs/arm_joint_pos";
    assert_eq!(problems(|_| ()), "");
    let missing = problems(|streams| streams.retain(|stream| stream.name != joints));
    assert!(missing.contains("obs/arm_joint_pos: it is missing"), "{missing}");
    let short = changed(|file| {
        file.delete_dataset("data/demo_0/rewards").unwrap();
        let made = demo_0(file).new_dataset::<f64>().shape([STEPS - 1]).create("rewards").unwrap();
        made.write_raw(&[0.0; STEPS - 1]).unwrap();
    });
    assert!(short.contains("/data/demo_0/rewards, steps: 8, expected 9"), "{short}");
}

#[test]
fn a_stream_that_was_changed_after_the_recording_is_reported() {
    let rewritten = |digest: Option<&str>| {
        changed(|file| {
            file.delete_dataset("data/demo_0/rewards").unwrap();
            let made = demo_0(file).new_dataset::<f64>().shape([STEPS]).create("rewards").unwrap();
            made.write_raw(&[0.25; STEPS]).unwrap();
            if let Some(digest) = digest {
                let attribute = made.new_attr::<rust_hdf5::VarLenUnicode>().shape(()).create("sha256");
                attribute.unwrap().write_string(digest).unwrap();
            }
        })
    };
    let found = rewritten(Some(&StreamValues::F64(vec![0.0; STEPS]).sha256()));
    assert!(found.contains("/data/demo_0/rewards: it was changed after the recording"), "{found}");
    assert_eq!(rewritten(Some(&StreamValues::F64(vec![0.25; STEPS]).sha256())), "");
    assert!(rewritten(None).contains("/data/demo_0/rewards: it has no sha256"));
}

#[test]
fn commanded_rotations_take_the_place_of_continuous_ones() {
    let mut demonstration = demonstration(0.0);
    let rows = numbers(&mut demonstration.streams, actions_in(GripCode::Continuous)).clone();
    // The same rotations by the vectors that are a full turn away.
    let opposite = |vector: Vec3| vector * (1.0 - 2.0 * PI / vector.norm());
    let rotations = rows.as_chunks::<7>().0.iter().map(|row| Vec3::from_column_slice(&row[3..6]));
    let commanded: Vec<Vec3> = rotations.map(opposite).collect();
    let vectors = commanded.iter().flat_map(|vector| <[f64; 3]>::from(*vector)).collect();
    demonstration.streams.push(stream(COMMANDED_ROTATIONS, NumberType::F64, &[3], vectors));
    let (_folder, path) = write(&demonstration, "task.hdf5");
    let actions = TaskFile::open(&path).unwrap().actions(0).unwrap();
    for ((action, row), vector) in actions.iter().zip(rows.as_chunks::<7>().0).zip(&commanded) {
        assert_eq!(*action, Action { axis_angle_b: *vector, ..Action::from_array(*row) });
    }
    assert_eq!(file(&path).unwrap().problems, [""; 0]);
}

#[test]
fn attributes_that_differ_from_the_record_are_reported() {
    for name in ["num_samples", "task_id", "demo_id", "attempt", "success"] {
        let text = changed(|file| demo_0(file).set_attr_numeric(name, &77_i64).unwrap());
        assert!(text.contains(&format!("/data/demo_0, attribute {name}: not ")), "{name}: {text}");
    }
    let rate = changed(|file| {
        file.root_group().group("data").unwrap().set_attr_numeric("fps", &10_i64).unwrap();
    });
    assert!(rate.contains("/data, attribute fps: expected 20"), "{rate}");
}

#[test]
fn a_file_truncated_anywhere_is_reported_by_name() {
    let (folder, path) = write(&demonstration(0.0), "whole.hdf5");
    let whole = fs::read(&path).unwrap();
    for share in [0.0, 0.001, 0.3, 0.7, 0.99] {
        let cut = folder.path().join("cut.hdf5");
        fs::write(&cut, &whole[..(share * whole.len() as f64) as usize]).unwrap();
        let message = match file(&cut) {
            Ok(report) => report.problems.join("\n"),
            Err(error) => error.to_string(),
        };
        assert!(message.contains("cut.hdf5"), "{share}: {message:?}");
    }
    let none = folder.path().join("none.hdf5");
    let missing = TaskFile::open(&none).err().unwrap().to_string();
    assert!(missing.starts_with("cannot read"), "it is missing");
}

/// The report on a file whose group `/data/demo_0` `change` has modified.
fn changed(change: impl Fn(&H5File)) -> String {
    let (_folder, path) = write(&demonstration(0.0), "task.hdf5");
    let hdf5 = H5File::open_rw(&path).unwrap();
    change(&hdf5);
    hdf5.close().unwrap();
    match file(&path) {
        Ok(report) => report.problems.join("\n"),
        Err(error) => error.to_string(),
    }
}

fn demo_0(file: &H5File) -> rust_hdf5::H5Group {
    file.root_group().group("data").unwrap().group("demo_0").unwrap()
}

#[test]
fn groups_and_arrays_without_end_are_refused() {
    let many = changed(|file| {
        let group = demo_0(file).create_group("many").unwrap();
        (0..4100).for_each(|i| drop(group.create_group(&i.to_string()).unwrap()));
    });
    assert!(many.contains("more than 4096 groups and datasets"), "{many}");
    let large = changed(|file| {
        let array = demo_0(file).new_dataset::<f32>().shape([STEPS, 1 << 40]).chunk(&[1, 1 << 20]);
        drop(array.create("x").unwrap());
    });
    assert!(large.contains("/data/demo_0/x: its shape [9, 1099511627776] is above 2 GiB"), "{large}");
}

#[test]
fn links_in_the_place_of_streams_are_reported() {
    let soft = changed(|file| {
        file.delete_dataset("data/demo_0/rewards").unwrap();
        demo_0(file).create_soft_link("rewards", "/data/demo_0/dones").unwrap();
    });
    assert!(soft.contains("/data/demo_0/rewards: it is a link to /data/demo_0/dones"), "{soft}");
    let external = changed(|file| {
        file.delete_dataset("data/demo_0/rewards").unwrap();
        demo_0(file).create_external_link("rewards", "x.hdf5", "/y").unwrap();
    });
    assert!(external.contains("/data/demo_0/rewards: it is a link to /y in the file x.hdf5"), "{external}");
    let looped = changed(|file| demo_0(file).group("obs").unwrap().link("obs", "/data/demo_0/obs").unwrap());
    assert!(looped.contains("/data/demo_0/obs/obs: it is a link to /data/demo_0/obs"), "{looped}");
}

#[test]
fn a_stream_of_another_type_or_row_shape_is_reported() {
    let rewards = |values: StreamValues, row_shape: Vec<usize>| {
        problems(|streams| {
            let stream = named(streams, "rewards");
            (stream.values, stream.row_shape) = (values.clone(), row_shape.clone());
        })
    };
    let other_type = rewards(StreamValues::U8(vec![0; STEPS]), Vec::new());
    assert!(other_type.contains("/data/demo_0/rewards: expected float64"), "{other_type}");
    let wide = rewards(StreamValues::F64(vec![0.0; 2 * STEPS]), vec![2]);
    assert!(wide.contains("got float64 with [2] per step"), "{wide}");
}

#[test]
fn names_that_are_not_of_demonstrations_are_refused() {
    for name in ["demo_1_aug", "demo_01", "demo_+1", "episode"] {
        let found = changed(|file| {
            file.root_group().group("data").unwrap().create_group(name).unwrap();
        });
        assert!(found.contains(&format!("/data/{name}: expected only groups demo_0, demo_1, …")), "{found}");
    }
}

#[test]
fn files_with_streams_without_a_digest_are_noticed_once() {
    let (_folder, path) = write(&demonstration(0.0), "task.hdf5");
    assert_eq!(without_digest(std::slice::from_ref(&path)).unwrap(), None);
    let hdf5 = H5File::open_rw(&path).unwrap();
    for name in ["rewards", "dones"] {
        hdf5.delete_dataset(&format!("data/demo_0/{name}")).unwrap();
        let made = demo_0(&hdf5).new_dataset::<f64>().shape([STEPS]).create(name).unwrap();
        made.write_raw(&[0.0; STEPS]).unwrap();
    }
    hdf5.close().unwrap();
    let notice = without_digest(&[path]).unwrap().unwrap();
    assert!(notice.contains("it has no sha256") && notice.ends_with("(2 streams in all)"), "{notice}");
}

#[test]
fn counts_of_another_file_are_reported() {
    let counts = [usize::MAX, 1 << 62];
    let (_folder, path) =
        write_as(&demonstration(0.0), "task.hdf5", &json!({ "env_name": "softvt" }), counts);
    let found = file(&path).unwrap().problems.join("\n");
    assert!(found.contains("attribute total: expected 9"), "{found}");
    assert!(found.contains("attribute num_demos: expected 1"), "{found}");
}
