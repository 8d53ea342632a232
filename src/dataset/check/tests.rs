//! Files with one error each, and the problems found in them.

use std::{fs, path::PathBuf};

use rust_hdf5::{H5File, Selection};
use serde_json::json;

use super::*;
use crate::{DataStream, Demonstration, hdf5::write_file, merge_parts};

use softvt_policy::Action;
use softvt_sensing::tactile::Markers;

const STEPS: usize = 9;

/// A demonstration whose tool turns while it rises.
fn demonstration(salt: f64) -> Demonstration {
    let posture = |step: usize| [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8].map(|q| q + 0.01 * step as f64 + salt);
    let place = |step: usize| panda::tool_pose(&posture(step)).translation.vector;
    let turns = (0..STEPS).map(|step| rotation::axis_angle(&panda::tool_pose(&posture(step)).rotation));
    let turns: Vec<Vec3> = rotation::continuous(turns).collect();
    let turn = |step: usize| turns[step];
    let q = |step: usize| rotation::from_axis_angle(&turn(step));
    let each = |row: &dyn Fn(usize) -> Vec<f64>| (0..STEPS).flat_map(row).collect::<Vec<f64>>();
    let state = |step: usize| {
        let (p, r) = (place(step), turn(step));
        vec![p.x, p.y, p.z, r.x, r.y, r.z, 0.03]
    };
    let pose = |step: usize| {
        let (p, q) = (place(step), q(step));
        vec![p.x, p.y, p.z, q.w, q.i, q.j, q.k]
    };
    let constant = |name: &str, row: &[usize], value: f64| {
        DataStream::f64(name, row, vec![value; STEPS * row.iter().product::<usize>()]).unit("m", "")
    };
    let spread: [[f32; 2]; MARKER_COUNT] = std::array::from_fn(|marker| [1.5 + marker as f32, 1.5]);
    let mut demonstration = Demonstration {
        record: serde_json::from_str(include_str!("../../../tests/data/episode_record.json"))
            .expect("a valid record"),
        actions: (0..STEPS).map(|step| Action::new(place(step), turn(step), 0.3)).collect(),
        joint_commands: (0..STEPS).map(posture).collect(),
        gripper_closed: (0..STEPS).map(|step| step > 4).collect(),
        grip_labels_n: (0..STEPS).map(|step| if step > 4 { 2.5 } else { -1.0 }).collect(),
        observed: vec![
            DataStream::f64("obs/eef_pose", &[7], each(&pose)),
            DataStream::f64("obs/state", &[7], each(&state)),
            DataStream::f64("obs/arm_joint_pos", &[7], each(&|step| posture(step).to_vec())),
            constant("obs/gripper_pos", &[2], 0.03),
            constant("obs/gripper_width", &[1], 0.06),
            constant("obs/gripper_width_sensed", &[1], 0.0592),
            constant("obs/gripper_close_norm", &[1], 0.25),
            DataStream::f64(
                "obs/gripper_closure",
                &[1],
                each(&|step| vec![if step == 0 { 0.0 } else { 0.3 }]),
            ),
        ],
        privileged: vec![
            DataStream::f32("privileged/states/deformable_object/bun/nodal_pos_w", &[70_000, 3], {
                (0..STEPS * 210_000).map(|i| (i as f32 * 1e-4).sin()).collect()
            }),
            DataStream::u8("privileged/contact", &[2], vec![1; 2 * STEPS]).attribute("meaning", "touching"),
        ],
    };
    demonstration.set_markers(&[[Markers { initial: spread, current: spread }; 2]; STEPS]);
    demonstration
}

fn write(demonstration: &Demonstration, name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write_file(&path, &json!({ "env_name": "softvt" }), STEPS, 1, |writer| {
        writer.write_attributes(0, &demonstration.record, STEPS)?;
        writer.write_streams(0, demonstration)
    })
    .unwrap();
    (folder, path)
}

/// The problems of a file whose streams `change` has damaged.
fn problems(change: impl Fn(&mut Vec<DataStream>)) -> String {
    let mut demonstration = demonstration(0.0);
    change(&mut demonstration.observed);
    let (_folder, path) = write(&demonstration, "task.hdf5");
    let found = file(&path).unwrap().problems;
    assert!(found.iter().all(|line| line.contains("task.hdf5: /data/demo_0/")), "{found:?}");
    found.join("\n")
}

fn numbers(stream: &mut DataStream) -> &mut Vec<f64> {
    let StreamValues::F64(numbers) = &mut stream.values else { panic!("{} is of doubles", stream.name) };
    numbers
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
    for (demo, demonstration) in both.iter().enumerate() {
        let mut back = read.read(demo).unwrap();
        let order = |streams: &mut Vec<DataStream>| {
            streams.sort_by(|a, b| a.name.cmp(&b.name));
            streams.iter_mut().for_each(|stream| stream.attributes.sort());
        };
        let mut demonstration = demonstration.clone();
        for streams in [
            &mut back.observed,
            &mut back.privileged,
            &mut demonstration.observed,
            &mut demonstration.privileged,
        ] {
            order(streams);
        }
        assert_eq!(back, demonstration);
        assert_eq!(read.actions(demo).unwrap(), demonstration.actions);
    }
    assert!(read.actions(2).unwrap_err().to_string().contains("there is no demo_2; there are 2"));
    let report = file(&path).unwrap();
    assert_eq!(report.problems, [""; 0]);
    assert_eq!((report.demos, report.steps), (2, 2 * STEPS));
}

#[test]
fn problems_of_a_stream_name_its_file_and_key() {
    assert_eq!(problems(|_| ()), "");
    let missing = problems(|streams| drop(streams.remove(2)));
    assert!(missing.contains("/data/demo_0/obs/arm_joint_pos: it is missing"), "{missing}");
    let bare = problems(|streams| numbers(&mut streams[3])[5] = f64::NAN);
    assert!(bare.contains("obs/gripper_pos: step 2: a number that is not finite"), "{bare}");
    let shape =
        problems(|streams| streams[2] = DataStream::f64("obs/arm_joint_pos", &[6], vec![0.0; 6 * STEPS]));
    assert!(shape.contains("obs/arm_joint_pos: expected the shape (steps, 7), got [9, 6]"), "{shape}");
}

/// The same rotation by the vector that is a full turn away.
fn opposite(vector: Vec3) -> Vec3 {
    vector * (1.0 - 2.0 * PI / vector.norm())
}

#[test]
fn commands_that_change_sign_at_half_a_turn_are_written_continuously_and_read_bit_for_bit() {
    let mut demonstration = demonstration(0.0);
    let states = demonstration.actions.clone();
    for action in demonstration.actions.iter_mut().step_by(2) {
        action.axis_angle_b = opposite(action.axis_angle_b);
    }
    let (_folder, path) = write(&demonstration, "task.hdf5");
    let read = TaskFile::open(&path).unwrap();
    assert_eq!(read.actions(0).unwrap(), demonstration.actions);
    for code in GripCode::ALL {
        let rows = read.array(0, actions_stream_name(code)).unwrap().values;
        for (row, action) in rows.as_chunks::<7>().0.iter().zip(&states) {
            assert!(
                (Action::from_array(*row).axis_angle_b - action.axis_angle_b).norm() < 1e-12,
                "{code:?}: {row:?}"
            );
        }
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
            for row in &mut numbers(&mut streams[1]).as_chunks_mut::<7>().0[rows.clone()] {
                let other = opposite(Vec3::from_column_slice(&row[3..6]));
                row[3..6].copy_from_slice(other.as_slice());
            }
        });
        assert!(text.contains(words) && text.contains("record again"), "{text}");
    }
}

#[test]
fn readings_in_other_units_or_without_content_are_reported() {
    let scaled = |at: usize, factor: f64| {
        problems(|streams| numbers(&mut streams[at]).iter_mut().for_each(|value| *value *= factor))
    };
    for (at, factor, words) in [
        (2, 180.0 / std::f64::consts::PI, "obs/arm_joint_pos: step 0: beyond the limits of the joints"),
        (2, 0.9, "obs/arm_joint_pos: step 0: not the joint positions at obs/eef_pose"),
        (3, 1e3, "obs/gripper_pos: step 0: expected positions of the fingers in 0..0.04 m"),
        (4, 1e3, "obs/gripper_width: step 0: not the sum of obs/gripper_pos"),
        (5, 1e3, "obs/gripper_width_sensed: step 0: not near obs/gripper_width"),
        (5, 0.0, "obs/gripper_width_sensed: step 0: not near obs/gripper_width"),
        (6, 100.0, "obs/gripper_close_norm: step 0: not 1 - width / 0.08 m"),
        (7, 255.0, "obs/gripper_closure: step 1: expected a closure in 0..1"),
        (7, 0.5, "obs/gripper_closure: step 1: not the closure that the action before commands"),
    ] {
        let text = scaled(at, factor);
        assert!(text.contains(words), "{words}: {text}");
    }
    let picture = |step: usize| if step == 4 { [7; 12] } else { std::array::from_fn(|i| i as u8) };
    let text = problems(|streams| {
        let pixels = (0..STEPS).flat_map(picture).collect();
        streams.push(DataStream::u8("obs/agentview_rgb", &[2, 2, 3], pixels));
        numbers(&mut streams[1]).chunks_exact_mut(7).for_each(|row| row[6] = 0.06);
        let markers = streams.iter_mut().find(|stream| stream.name == "obs/gripper_marker_motion");
        let StreamValues::F32(markers) = &mut markers.expect("markers").values else { panic!("float32") };
        markers[8 * MARKER_COUNT..].fill(0.0);
    });
    for words in [
        "obs/agentview_rgb: step 4: a picture of one colour",
        "obs/state: step 0: its last number is not half of obs/gripper_width",
        "obs/gripper_marker_motion: step 1: all markers of a finger are at one place",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn cameras_that_move_or_have_another_matrix_are_reported() {
    let camera = |places: &dyn Fn(usize) -> f64, matrix: &str| {
        problems(|streams| {
            let rows = (0..STEPS).flat_map(|step| [places(step), 0.0, 0.5, 1.0, 0.0, 0.0, 0.0]).collect();
            let poses = DataStream::f64("obs/agentview_pose", &[7], rows);
            streams.push(poses.attribute("intrinsic", matrix));
            let pixels = (0..STEPS * 24).map(|at| at as u8).collect();
            streams.push(DataStream::u8("obs/agentview_rgb", &[2, 4, 3], pixels));
        })
    };
    let matrix = "[[3.0, 0.0, 2.0], [0.0, 3.0, 1.0], [0.0, 0.0, 1.0]]";
    assert_eq!(camera(&|_| 1.0, matrix), "");
    let moving = camera(&|step| 0.1 * step as f64, matrix);
    assert!(moving.contains("obs/agentview_pose: step 1: the camera moves"), "{moving}");
    for wrong in
        ["[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]", "none", &matrix.replace("1.0]", "2.0]")]
    {
        let text = camera(&|_| 1.0, wrong);
        assert!(text.contains("obs/agentview_pose: attribute intrinsic: expected one focal"), "{text}");
    }
}

#[test]
fn attributes_that_differ_from_the_record_are_reported() {
    for name in ["num_samples", "task_id", "demo_id", "attempt", "success"] {
        let text = changed(|file| demo_0(file).set_attr_numeric(name, &77_i64).unwrap());
        assert!(text.contains(&format!("/data/demo_0, attribute {name}: expected ")), "{name}: {text}");
    }
    let rate = changed(|file| {
        file.root_group().group("data").unwrap().set_attr_numeric("fps", &10_i64).unwrap();
    });
    assert!(rate.contains("/data, attribute fps: expected 20 control steps per second"), "{rate}");
}

#[test]
fn joint_positions_and_widths_of_other_actions_are_reported() {
    let with = |change: &dyn Fn(&mut Demonstration)| {
        let mut demonstration = demonstration(0.0);
        change(&mut demonstration);
        let (_folder, path) = write(&demonstration, "task.hdf5");
        file(&path).unwrap().problems.join("\n")
    };
    let turned = with(&|demonstration| {
        demonstration.joint_commands.iter_mut().flatten().for_each(|joint| *joint += 0.05);
    });
    assert!(
        turned.contains("actions_joints: ") && turned.contains("mm from the poses of the actions"),
        "{turned}"
    );
    let late = with(&|demonstration| demonstration.joint_commands.rotate_right(1));
    assert!(late.contains("actions_joints: they are one control step earlier or later"), "{late}");
    let name = "data/demo_0/actions_two_width";
    let (_folder, path) = write(&demonstration(0.0), "task.hdf5");
    let mut rows = H5File::open(&path).unwrap().dataset(name).unwrap().read_raw::<f64>().unwrap();
    rows.chunks_exact_mut(7).for_each(|row| row[6] *= 0.5);
    let narrow = changed(|file| {
        file.delete_dataset(name).unwrap();
        let made = demo_0(file).new_dataset::<f64>().shape([STEPS, 7]).create("actions_two_width");
        made.unwrap().write_raw(&rows).unwrap();
    });
    assert!(narrow.contains("actions_two_width: step 5: not 0 while open, and the median"), "{narrow}");
}

#[test]
fn markers_outside_of_the_picture_or_exchanged_are_reported() {
    let markers = |change: &dyn Fn(&mut [f32])| {
        problems(|streams| {
            let markers = streams.iter_mut().find(|stream| stream.name == "obs/gripper_marker_motion");
            let StreamValues::F32(markers) = &mut markers.expect("markers").values else { panic!("float32") };
            change(markers);
        })
    };
    let far = markers(&|all| all.iter_mut().for_each(|at| *at *= 10.0));
    assert!(far.contains("step 0: a marker outside of the tactile picture"), "{far}");
    let moved = markers(&|all| all[8 * MARKER_COUNT] += 1.0);
    assert!(moved.contains("step 1: initial positions of markers that are not those"), "{moved}");
}

#[test]
fn forces_of_an_open_hand_have_the_value_of_their_code() {
    let mut scaled = demonstration(0.0);
    scaled.grip_labels_n.iter_mut().for_each(|label| *label *= 10.0);
    let (_folder, path) = write(&scaled, "task.hdf5");
    let found = file(&path).unwrap().problems;
    assert!(found[0].contains("actions_force: step 0: not the actions in the grip code force"), "{found:?}");
}

#[test]
fn true_states_that_contradict_each_other_are_reported() {
    let mut wrong = demonstration(0.0);
    wrong.privileged.push(DataStream::f64("privileged/pad_force", &[2], vec![0.0; 2 * STEPS]));
    wrong.privileged.push(DataStream::f64("privileged/d", &[], vec![0.2; STEPS]));
    wrong.privileged.push(DataStream::f64("privileged/d_max", &[], vec![0.1; STEPS]));
    wrong.privileged.push(DataStream::f64("privileged/gripper_net_force", &[2, 3], vec![0.0; 6 * STEPS]));
    wrong.privileged.push(DataStream::f64("privileged/actions_with_force", &[13], vec![0.0; 13 * STEPS]));
    let pose = [500.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0].repeat(STEPS);
    wrong.privileged.push(DataStream::f64("privileged/states/rigid_object/can/root_pose_w", &[7], pose));
    let StreamValues::F32(nodes) = &mut wrong.privileged[0].values else { panic!("float32") };
    nodes[210_000..420_000].fill(0.0);
    let (_folder, path) = write(&wrong, "task.hdf5");
    let text = file(&path).unwrap().problems.join("\n");
    for words in [
        "privileged/contact: step 0: not where privileged/pad_force is above 0",
        "privileged/d: step 0: expected 0 or more and at most privileged/d_max",
        "privileged/actions_with_force: step 0: not the action and privileged/gripper_net_force",
        "can/root_pose_w: step 0: a place more than 20 m away",
        "bun/nodal_pos_w: step 1: all nodes are at one place",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let ends = changed(|file| {
        file.delete_dataset("data/demo_0/rewards").unwrap();
        demo_0(file)
            .new_dataset::<f64>()
            .shape([STEPS])
            .create("rewards")
            .unwrap()
            .write_raw(&[0.0; STEPS])
            .unwrap();
    });
    assert!(ends.contains("rewards: step 8: expected 1 in the last step and 0 before"), "{ends}");
}

#[test]
fn joint_positions_torques_and_depths_in_other_units_are_reported() {
    let text = problems(|streams| {
        streams.push(DataStream::f64("obs/joint_torques", &[7], vec![0.0; 7 * STEPS]));
        streams.push(DataStream::f32("obs/agentview_depth", &[2, 2], vec![900.0; 4 * STEPS]));
    });
    for words in
        ["obs/joint_torques: step 1: no torque", "obs/agentview_depth: step 0: a depth that is neither"]
    {
        assert!(text.contains(words), "{text}");
    }
    let mut in_degrees = demonstration(0.0);
    in_degrees.joint_commands[3] = in_degrees.joint_commands[3].map(f64::to_degrees);
    let (_folder, path) = write(&in_degrees, "task.hdf5");
    let text = file(&path).unwrap().problems.join("\n");
    assert!(
        text.contains("actions_joints: step 3: joint 1 at")
            || text.contains("actions_joints: step 3: joint 2 at"),
        "{text}"
    );
    let mut elsewhere = demonstration(0.0);
    elsewhere.actions[2].joints = Some(elsewhere.joint_commands[2]);
    elsewhere.actions[2].position_b.x += 0.01;
    let (_folder, path) = write(&elsewhere, "task.hdf5");
    let text = file(&path).unwrap().problems.join("\n");
    assert!(
        text.contains("actions_joints: step 2: not the joint positions at the pose of the action"),
        "{text}"
    );
}

#[test]
fn quaternions_of_another_order_or_sign_are_distinguished() {
    let turned = problems(|streams| {
        numbers(&mut streams[0]).chunks_exact_mut(7).for_each(|row| row[3..].rotate_left(1));
    });
    assert!(turned.contains("obs/eef_pose: step 0"), "{turned}");
    assert!(turned.contains("is its order w x y z?"), "{turned}");
    let signed = problems(|streams| {
        numbers(&mut streams[0])
            .chunks_exact_mut(7)
            .for_each(|row| row[3..].iter_mut().for_each(|x| *x = -*x));
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
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("task.hdf5");
        let environment = json!({ "env_name": "softvt", "env_kwargs": { "script": script } });
        let demonstration = demonstration(0.0);
        write_file(&path, &environment, total, demos, |writer| {
            writer.write_attributes(0, &demonstration.record, STEPS)?;
            writer.write_streams(0, &demonstration)
        })
        .unwrap();
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
