//! Files with one error each, and the problems found in them.

use std::{fs, path::PathBuf};

use rust_hdf5::{H5File, Selection};
use serde_json::json;

use super::*;
use crate::{
    Demonstration, StreamValues,
    hdf5::write_file,
    merge_parts,
    streams::{COMMANDED_ROTATIONS, actions_in},
};
use softvt_policy::{Action, NumberType, profile::GripCode};
use softvt_robot::panda;

const STEPS: usize = 9;

fn stream(name: &str, number_type: NumberType, row_shape: &[usize], numbers: Vec<f64>) -> DataStream {
    let (values, row_shape) = (StreamValues::new(number_type, numbers), row_shape.to_vec());
    DataStream { name: name.to_owned(), row_shape, values, attributes: Vec::new() }
}

/// A demonstration whose tool turns while it rises.
fn demonstration(salt: f64) -> Demonstration {
    let posture = |step: usize| [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8].map(|q| q + 0.01 * step as f64 + salt);
    let pose = |step: usize| panda::tool_pose(&posture(step));
    let turns: Vec<Vec3> =
        rotation::continuous((0..STEPS).map(|step| rotation::axis_angle(&pose(step).rotation))).collect();
    let row = |step: usize, last: f64| {
        let (p, r) = (pose(step).translation.vector, turns[step]);
        vec![p.x, p.y, p.z, r.x, r.y, r.z, last]
    };
    let numbers = |spec: &StreamSpec, step: usize| -> Vec<f64> {
        match spec.path {
            "obs/eef_pose" => softvt_policy::pose_row(&pose(step)).to_vec(),
            "obs/state" => row(step, 0.03),
            "obs/arm_joint_pos" | "actions_joints" => posture(step).to_vec(),
            path if path.starts_with("actions") => row(step, 0.0),
            _ => vec![0.0; spec.row.iter().flatten().product()],
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

/// The stream of a name.
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
fn problems_of_a_stream_name_its_file_and_key() {
    assert_eq!(problems(|_| ()), "");
    let joints = "obs/arm_joint_pos";
    let replaced = |number_type, row: &[usize]| {
        problems(|streams| {
            let zeros = vec![0.0; STEPS * row.iter().product::<usize>()];
            *named(streams, joints) = stream(joints, number_type, row, zeros);
        })
    };
    let scaled = |name: &str, factor: f64| {
        problems(|streams| numbers(streams, name).iter_mut().for_each(|number| *number *= factor))
    };
    for (found, words) in [
        (
            problems(|streams| streams.retain(|stream| stream.name != joints)),
            "obs/arm_joint_pos: it is missing",
        ),
        (
            problems(|streams| numbers(streams, "obs/gripper_pos")[5] = f64::NAN),
            "obs/gripper_pos: step 2: NaN is not a finite number",
        ),
        (
            replaced(NumberType::F64, &[6]),
            "arm_joint_pos: expected float64 of shape (T, 7), got float64 with [6]",
        ),
        (replaced(NumberType::F32, &[7]), "arm_joint_pos: expected float64 of shape (T, 7), got float32"),
        (scaled(joints, 180.0 / PI), "arm_joint_pos: step 0: -28.64"),
        (scaled("obs/state", 1e3), "obs/state: step 0: "),
    ] {
        assert!(found.contains(words), "{words}: {found}");
    }
    let depth = |metres: f64| {
        problems(|streams| {
            streams.push(stream("obs/agentview_depth", NumberType::F32, &[2, 2], vec![metres; 4 * STEPS]));
        })
    };
    assert_eq!(depth(f64::INFINITY), "");
    assert!(depth(900.0).contains("obs/agentview_depth: step 0: 900; expected at most 100 in magnitude"));
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
    assert_eq!(rewritten(None), "", "a stream that another program has written anew has no digest");
}

/// The same rotation by the vector that is a full turn away.
fn opposite(vector: Vec3) -> Vec3 {
    vector * (1.0 - 2.0 * PI / vector.norm())
}

#[test]
fn commanded_rotations_take_the_place_of_continuous_ones() {
    let mut demonstration = demonstration(0.0);
    let rows = numbers(&mut demonstration.streams, actions_in(GripCode::Continuous)).clone();
    let commanded: Vec<Vec3> =
        rows.as_chunks::<7>().0.iter().map(|row| opposite(Vec3::from_column_slice(&row[3..6]))).collect();
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
fn rotation_vectors_that_change_sign_are_counted() {
    for (rows, words) in [
        (4..STEPS, "obs/state: 1 jump of the rotation vector by a full turn"),
        (4..5, "obs/state: 2 jumps of the rotation vector"),
        // A demonstration on the other side than the others.
        (0..STEPS, "obs/state: 1 jump of the rotation vector"),
    ] {
        let text = problems(|streams| {
            for row in &mut numbers(streams, "obs/state").as_chunks_mut::<7>().0[rows.clone()] {
                let other = opposite(Vec3::from_column_slice(&row[3..6]));
                row[3..6].copy_from_slice(other.as_slice());
            }
        });
        assert!(text.contains(words) && text.contains("record again"), "{text}");
    }
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
    assert!(rate.contains("/data, attribute fps: expected 20 control steps per second"), "{rate}");
}

#[test]
fn quaternions_of_another_order_or_sign_are_distinguished() {
    let turned = problems(|streams| {
        numbers(streams, "obs/eef_pose").chunks_exact_mut(7).for_each(|row| row[3..].rotate_left(1));
    });
    assert!(turned.contains("obs/eef_pose: step 0"), "{turned}");
    assert!(turned.contains("is its order w x y z?"), "{turned}");
    let signed = problems(|streams| {
        let rows = numbers(streams, "obs/eef_pose").chunks_exact_mut(7);
        rows.for_each(|row| row[3..].iter_mut().for_each(|x| *x = -*x));
    });
    assert!(signed.contains("with w >= 0"), "{signed}");
    assert!(!signed.contains("order"), "the same rotation: {signed}");
}

#[test]
fn a_file_truncated_anywhere_is_reported_by_name() {
    let (folder, path) = write(&demonstration(0.0), "whole.hdf5");
    let whole = fs::read(&path).unwrap();
    for share in [0.0, 0.001, 0.3, 0.7, 0.99, 0.9999] {
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
fn a_group_that_contains_itself_is_refused_by_name() {
    let looped = changed(|file| demo_0(file).link("loop", "/data").unwrap());
    assert!(
        looped.contains("/data/demo_0/loop: it is a link to /data; expected the data itself"),
        "{looped}"
    );
    let obs = changed(|file| demo_0(file).group("obs").unwrap().link("obs", "/data/demo_0/obs").unwrap());
    assert!(obs.contains("/data/demo_0/obs/obs: it is a link to /data/demo_0/obs"), "{obs}");
}

#[test]
fn deep_and_numerous_groups_are_refused() {
    let deep = changed(|file| {
        (0..20).fold(demo_0(file), |group, _| group.create_group("g").unwrap());
    });
    assert!(deep.contains("/g/g: its groups are nested more than 16 deep"), "{deep}");
    let many = changed(|file| {
        let group = demo_0(file).create_group("many").unwrap();
        (0..4100).for_each(|i| drop(group.create_group(&i.to_string()).unwrap()));
    });
    assert!(many.contains("more than 4096 groups and datasets"), "{many}");
}

#[test]
fn arrays_without_end_are_refused_before_they_are_read() {
    let add = |shape: &[usize], chunk: &[usize]| {
        changed(|file| drop(demo_0(file).new_dataset::<f32>().shape(shape).chunk(chunk).create("x").unwrap()))
    };
    let rank = add(&[1; 32], &[1; 32]);
    assert!(rank.contains("/data/demo_0/x: it has 32 axes; at most 8 are read"), "{rank}");
    let size = add(&[STEPS, 1 << 40], &[1, 1 << 20]);
    assert!(size.contains("/data/demo_0/x: its shape [9, 1099511627776] is above 2 GiB"), "{size}");
    let chunks = add(&[1 << 11, 1 << 11], &[1, 1]);
    assert!(chunks.contains("/data/demo_0/x: it has 4194304 chunks"), "{chunks}");
}

#[test]
fn data_in_other_files_are_refused() {
    let linked = changed(|file| {
        file.delete_dataset("data/demo_0/rewards").unwrap();
        demo_0(file).create_external_link("rewards", "x.hdf5", "/y").unwrap();
    });
    assert!(linked.contains("/data/demo_0/rewards: it is a link to /y in the file x.hdf5"), "{linked}");
    let soft = changed(|file| {
        file.delete_dataset("data/demo_0/rewards").unwrap();
        demo_0(file).create_soft_link("rewards", "/data/demo_0/dones").unwrap();
    });
    assert!(soft.contains("/data/demo_0/rewards: it is a link to /data/demo_0/dones"), "{soft}");
    let mapped = changed(|file| {
        demo_0(file)
            .new_dataset::<f64>()
            .shape([STEPS])
            .virtual_mapping(Selection::All, "x.hdf5", "/y", Selection::All)
            .create("x")
            .unwrap();
    });
    assert!(
        mapped.contains("/data/demo_0/x: it is a virtual array: its numbers lie in other files"),
        "{mapped}"
    );
}

#[test]
fn counts_and_scripts_of_another_file_are_refused() {
    let problems = |script: &str, total: usize, demos: usize| {
        let environment = json!({ "env_name": "softvt", "env_kwargs": { "script": script } });
        let (_folder, path) = write_as(&demonstration(0.0), "task.hdf5", &environment, [total, demos]);
        file(&path).unwrap().problems.join("\n")
    };
    assert_eq!(problems("suites/object_soft.lua", STEPS, 1), "");
    let script = problems("../../../etc/passwd", STEPS, 1);
    assert!(script.contains("env_args, script: \"../../../etc/passwd\" leads out of the folder"), "{script}");
    assert!(problems("suites/../../x.lua", STEPS, 1).contains("env_args, script"));
    let counts = problems("x.lua", usize::MAX, 1 << 62);
    assert!(counts.contains("attribute total: another number than the 9 steps of the file"), "{counts}");
    assert!(counts.contains("attribute num_demos: another number than the 1 demonstration"), "{counts}");
}
