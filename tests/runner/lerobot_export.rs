//! Exports for LeRobot: rows are the inputs of a policy, and results do not depend on threads.

use std::{fs::File, path::Path, sync::OnceLock};

use parquet::{
    file::reader::{FileReader, SerializedFileReader},
    record::{Field, Row},
};
use rmpv::Value;
use softvt::{
    dataset::{
        OptionalStream, TaskFile,
        card::DatasetCard,
        export::{self, ArmControl, ExportConfig, ExportFormat, ExportSummary, LeRobotVersion},
        manifest,
    },
    episode_id::EpisodeSplit,
    policy::profile::GripCode,
};

use crate::{
    dataset_recording::Recording,
    serve::{Access, Server},
    support::{Project, SOLIDS, client::get, files},
};

pub(crate) const V21: ExportFormat = ExportFormat::LeRobot(LeRobotVersion::V21);
const V30: ExportFormat = ExportFormat::LeRobot(LeRobotVersion::V30);

/// Two demonstrations of each task with joint torques in the folder `data`.
pub(crate) fn recorded() -> &'static Project {
    static RECORDED: OnceLock<Project> = OnceLock::new();
    RECORDED.get_or_init(|| {
        let suite = include_str!("../data/touched_block.lua");
        let project = Project::shared("exports", &[("x.lua", suite), SOLIDS]);
        let with_torques = Recording::new(project.run("x.lua"), 2, "data");
        with_torques
            .with(|options| {
                options.streams = [OptionalStream::named("joint-torques").expect("a stream")].into()
            })
            .record();
        project
    })
}

/// An export from the folder `data` of a project into `out`.
pub(crate) fn config(project: &Project, format: ExportFormat, out: &str) -> ExportConfig {
    ExportConfig {
        data: project.path("data"),
        out: project.path(out),
        format,
        control: ArmControl::Pose,
        gripper: None,
        tasks: Vec::new(),
        threads: 2,
    }
}

pub(crate) fn export(config: &ExportConfig) -> ExportSummary {
    export::export(config, || false, |_, _| ()).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn rows(path: &Path) -> Vec<Row> {
    let reader = SerializedFileReader::new(File::open(path).expect("a table")).expect("Parquet");
    reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row")).collect()
}

pub(crate) fn field<'a>(row: &'a Row, name: &str) -> &'a Field {
    let found = row.get_column_iter().find(|(column, _)| *column == name);
    found.unwrap_or_else(|| panic!("no {name}")).1
}

/// Flattens nested lists of numbers.
pub(crate) fn numbers(field: &Field) -> Vec<f32> {
    match field {
        Field::Float(x) => vec![*x],
        Field::ListInternal(list) => list.elements().iter().flat_map(numbers).collect(),
        other => panic!("no numbers: {other:?}"),
    }
}

fn whole(field: &Field) -> i64 {
    match field {
        Field::Long(n) => *n,
        other => panic!("no whole number: {other:?}"),
    }
}

/// Decodes the pixels of a PNG file.
fn pixels(field: &Field) -> Vec<u8> {
    let Field::Group(group) = field else { panic!("no picture: {field:?}") };
    let bytes = group.get_column_iter().find(|(name, _)| *name == "bytes").map(|(_, bytes)| bytes.clone());
    let Some(Field::Bytes(bytes)) = bytes else { panic!("no bytes in {field:?}") };
    image::load_from_memory(bytes.data()).expect("a PNG file").to_rgb8().into_raw()
}

/// The bytes of an array as clients receive it.
fn sent(observation: &Value, name: &str) -> Vec<u8> {
    let entries = get(observation, name).as_map().expect("an array");
    let data =
        entries.iter().find(|(key, _)| key.as_str() == Some("data") || key.as_slice() == Some(b"data"));
    data.and_then(|(_, data)| data.as_slice()).expect("data").to_vec()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
}

#[test]
fn rows_are_the_inputs_of_a_policy() {
    let project = recorded();
    export(&config(project, V21, "inputs"));
    let rows = rows(&project.path("inputs/data/chunk-000/episode_000000.parquet"));
    let file = TaskFile::open(&project.path("data/hdf5/one_task0_demo.hdf5")).expect("a file");
    let (actions, written) =
        (file.actions(0).expect("actions"), file.array(0, "actions").expect("actions").values);
    assert!(
        rows.len() >= 12 && rows.len() == actions.len(),
        "longer than a policy's history: {}",
        rows.len()
    );
    let access = Access { split: EpisodeSplit::Demonstration, ..Access::default() };
    let server = Server::with(&project.run("x.lua").profile("visuo_tactile"), access);
    let (mut client, _) = server.client();
    let episode = manifest::read(&project.path("data")).expect("a manifest")[0].episode;
    let mut answer = client.reset(episode.into());
    let mut touched = false;
    for (step, ((row, action), written)) in
        rows.iter().zip(&actions).zip(written.as_chunks::<7>().0).enumerate()
    {
        let observation = get(&answer, "observation");
        for name in ["image", "wrist_image", "tactile_image"] {
            assert!(pixels(field(row, name)) == sent(observation, name), "{name} at step {step}");
        }
        assert_eq!(numbers(field(row, "state")), floats(&sent(observation, "state")), "step {step}");
        // A row keeps the initial state and the last two of nine.
        let markers = floats(&sent(observation, "tactile_marker_motion"));
        let kept: Vec<f32> = [0, 7, 8].into_iter().flat_map(|i| markers[396 * i..][..396].to_vec()).collect();
        assert_eq!(numbers(field(row, "tactile_marker_motion")), kept, "step {step}");
        touched |= kept[396..792] != kept[792..];
        assert_eq!(numbers(field(row, "actions")), written.map(|x| x as f32), "step {step}");
        answer = client.step(&[action.to_array()]);
    }
    assert!(touched, "the block moves markers");
    assert_eq!(get(&answer, "terminated").as_bool(), Some(true));
}

/// The key under which LeRobot's own policies look for a column of version 2.1.
fn key_of_lerobot(name: &str) -> &str {
    match name {
        "image" => "observation.images.third_person",
        "wrist_image" => "observation.images.wrist",
        "tactile_image" => "observation.images.tactile_image",
        "state" => "observation.state",
        "joint_torques" => "observation.joint_torques",
        "tactile_marker_motion" => "observation.tactile_marker_motion",
        "actions" => "action",
        other => other,
    }
}

#[test]
fn joint_positions_and_torques_are_exported() {
    let project = recorded();
    let joints =
        |format, out: &str| ExportConfig { control: ArmControl::Joints, ..config(project, format, out) };
    export(&joints(V21, "joints_a"));
    export(&joints(V30, "joints_b"));
    let file = TaskFile::open(&project.path("data/hdf5/one_task0_demo.hdf5")).expect("a file");
    let stream = |name: &str| file.array(0, name).expect("a stream").values;
    let (positions, torques) = (stream("obs/arm_joint_pos"), stream("obs/joint_torques"));
    let (widths, commands) = (stream("obs/gripper_width_sensed"), file.joint_commands(0).expect("joints"));
    let actions = file.actions(0).expect("actions");
    let single = |numbers: &[f64]| numbers.iter().map(|x| *x as f32).collect::<Vec<f32>>();
    let apart = rows(&project.path("joints_a/data/chunk-000/episode_000000.parquet"));
    let together = rows(&project.path("joints_b/data/chunk-000/file-000.parquet"));
    assert!(apart.len() == actions.len() && together.len() > actions.len());
    for (step, (row, other)) in apart.iter().zip(&together).enumerate() {
        let seven = 7 * step..7 * step + 7;
        let state = [&positions[seven.clone()], &[0.5 * widths[step]]].concat();
        assert_eq!(numbers(field(row, "state")), single(&state), "step {step}");
        let action = [&commands[step][..], &[actions[step].closure()]].concat();
        assert_eq!(numbers(field(row, "actions")), single(&action), "step {step}");
        assert_eq!(numbers(field(row, "joint_torques")), single(&torques[seven]), "step {step}");
        for (name, key) in [
            ("state", "observation.state"),
            ("actions", "action"),
            ("joint_torques", "observation.joint_torques"),
        ] {
            assert_eq!(field(row, name), field(other, key), "{name} at step {step}");
        }
    }
    assert!(torques.iter().any(|torque| torque.abs() > 0.05), "the hand pushes");
    let features = &project.json("joints_b/meta/info.json")["features"];
    assert_eq!(features["action"]["shape"][0], 8);
    assert_eq!(features["action"]["names"][6], "joint_7");
    assert_eq!(project.json("joints_a/meta/softvt.json")["control"], "joints");
}

#[test]
fn both_versions_have_the_same_rows() {
    let project = recorded();
    assert_eq!(DatasetCard::read(&project.path("data")).expect("a card").gripper, None);
    let v21 = |out: &str, threads| ExportConfig { threads, ..config(project, V21, out) };
    let exported = export(&v21("a", 1));
    assert_eq!((exported.episodes, exported.tasks), (4, 2));
    export(&v21("b", 3));
    assert!(files(&project.path("a")) == files(&project.path("b")), "not the same bytes");
    let v30 = |out: &str| config(project, V30, out);
    assert_eq!(export(&ExportConfig { data: project.path("data/"), ..v30("c/") }), exported);
    let apart: Vec<Row> = (0..4)
        .flat_map(|i| rows(&project.path(&format!("a/data/chunk-000/episode_{i:06}.parquet"))))
        .collect();
    let together = rows(&project.path("c/data/chunk-000/file-000.parquet"));
    assert_eq!((apart.len(), exported.frames), (together.len(), together.len()));
    for (index, (one, other)) in apart.iter().zip(&together).enumerate() {
        assert_eq!(whole(field(other, "index")), index as i64);
        for (name, value) in one.get_column_iter() {
            let found = field(other, key_of_lerobot(name));
            match name.ends_with("image") {
                true => assert!(pixels(value) == pixels(found), "{name}"),
                false => assert_eq!(value, found, "{name}"),
            }
        }
    }
    let info = project.json("c/meta/info.json");
    assert_eq!(info["total_frames"], together.len());
    assert_eq!((&info["splits"]["train"], &info["total_tasks"]), (&"0:4".into(), &2.into()));
    let episodes = rows(&project.path("c/meta/episodes/chunk-000/file-000.parquet"));
    let ends: Vec<i64> = episodes.iter().map(|row| whole(field(row, "dataset_to_index"))).collect();
    assert_eq!(ends.last(), Some(&(together.len() as i64)));
    let second = |gripper: GripCode, out: &str| {
        export(&ExportConfig { gripper: Some(gripper), tasks: vec!["for".to_owned()], ..v30(out) });
    };
    second(GripCode::Binary, "d");
    let binary = rows(&project.path("d/data/chunk-000/file-000.parquet"));
    assert_eq!(binary.len() as i64, ends[3] - ends[1], "only the second task");
    let gripper: Vec<f32> = binary.iter().map(|row| numbers(field(row, "action"))[6]).collect();
    assert!(gripper.iter().all(|x| [0.0, 1.0].contains(x)) && gripper.contains(&1.0), "{gripper:?}");
    assert_eq!(project.lines("d/meta/softvt.jsonl")[0]["task_id"], 1);
    assert_eq!(project.json("c/meta/softvt.json")["gripper"], "continuous");
    for (grip_code, stream) in [(GripCode::TwoWidth, "actions_two_width"), (GripCode::Force, "actions_force")]
    {
        let code = grip_code.name();
        second(grip_code, code);
        let stated = project.json(&format!("{code}/meta/softvt.json"));
        assert_eq!((&stated["gripper"], &stated["source"]), (&code.into(), &stream.into()));
        let rows = rows(&project.path(&format!("{code}/data/chunk-000/file-000.parquet")));
        let labels: Vec<f32> = rows.iter().map(|row| numbers(field(row, "action"))[6]).collect();
        let open = if code == "force" { -1.0 } else { 0.0 };
        for (label, closed) in labels.iter().zip(&gripper) {
            assert_eq!(*label == open, *closed == 0.0, "{code}: {labels:?}");
        }
        let held = labels.iter().copied().fold(0.0, f32::max);
        // The hand closes by 0.05 per step to 0.6, in less than half of the demonstration: the median is 0.6.
        assert!(if code == "force" { held > 1.0 } else { (held - 0.6).abs() < 1e-6 }, "{code}: {labels:?}");
    }
}
