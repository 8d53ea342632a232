//! Imports: re-execution of own and foreign demonstrations.

use std::path::{Path, PathBuf};

use rust_hdf5::H5File;
use softvt::{
    dataset::{StreamValues, TaskFile, check, manifest},
    runner::{
        RunError,
        import::{self, ImportOptions},
        recording::RecordingSummary,
    },
};

use crate::{
    dataset_recording::{Recording, is_reproduced},
    support::{PUSHED_CUBE, Project, Run, SOLIDS, assert_contains},
};

/// A project with a dataset of two demonstrations of task 0.
fn recorded() -> Project {
    let project = Project::new(&[("x.lua", PUSHED_CUBE), SOLIDS]);
    let recording = Recording::new(project.run("x.lua").tasks(&[0]), 2, "data");
    recording.with(|options| (options.has_images, options.has_privileged) = (false, false)).record();
    project
}

/// Imports files of a project into a folder.
fn import(
    run: &Run,
    files: &[&str],
    out: &str,
    options: ImportOptions,
) -> Result<Option<RecordingSummary>, String> {
    let project = run.project;
    let recording = Recording::new(run.clone(), 0, out).with(|options| options.has_images = false);
    let files: Vec<PathBuf> = files.iter().map(|file| project.path(file)).collect();
    let imported =
        || -> Result<_, RunError> { import::import(&run.load()?, &files, options, &recording.options) };
    imported().map_err(|error| project.relative(error))
}

const OWN: &str = "data/hdf5/one_task0_demo.hdf5";

/// Content of a SoftVTBench file, apart from its poses.
struct SyntheticFile<'a> {
    language: &'a str,
    /// Position of the cube.
    cube: [f64; 2],
    /// Number of poses of a push; the later ones are zeros.
    poses: usize,
}

/// Writes a file with one demonstration, which pushes the cube if it is where the layout has it.
fn write(from: &Path, into: &Path, content: &SyntheticFile) {
    let read = TaskFile::open(from).expect("a file");
    let numbers = |name: &str| match read.stream(0, name).expect("a stream").values {
        StreamValues::F64(numbers) => numbers,
        _ => panic!("{name} is of doubles"),
    };
    let (state, pose, joints) = (numbers("obs/state"), numbers("obs/eef_pose"), numbers("obs/arm_joint_pos"));
    let file = H5File::create(into).expect("made");
    let data = file.create_group("data").expect("a group");
    let demo = data.create_group("demo_0").expect("a group");
    demo.set_attr_string("language", content.language).expect("written");
    let observed = demo.create_group("obs").expect("a group");
    let steps = 24;
    let put = |group: &rust_hdf5::H5Group, name: &str, row: &[f64]| {
        let row_of = |step: usize| {
            let mut row = if step < content.poses { row.to_vec() } else { vec![0.0; row.len()] };
            if name != "arm_joint_pos" {
                row[1] -= if step < 8 { 0.02 } else { 0.005 };
            }
            row
        };
        let all: Vec<f64> = (0..steps).flat_map(row_of).collect();
        let array = group.new_dataset::<f64>().shape([steps, row.len()]).create(name).expect("an array");
        array.write_raw(&all).expect("written");
    };
    put(&demo, "actions", &[&state[..6], &[0.04]].concat());
    put(&observed, "eef_pose", &pose[..7]);
    put(&observed, "arm_joint_pos", &joints[..7]);
    let start = demo.create_group("initial_state").expect("a group");
    let kind = start.create_group("rigid_object").expect("a group");
    let cube = kind.create_group("cube_1").expect("a group");
    let root = cube.new_dataset::<f64>().shape([1, 7]).create("root_pose").expect("an array");
    root.write_raw(&[content.cube[0], content.cube[1], 0.9, 1.0, 0.0, 0.0, 0.0]).expect("written");
    file.close().expect("closed");
}

#[test]
fn own_demonstrations_end_in_the_same_states() {
    let project = recorded();
    let run = project.run("x.lua");
    import(&run, &[OWN], "again", ImportOptions::default()).expect("valid");
    let entries = |folder: &str| manifest::read(&project.path(folder)).expect("a manifest");
    let states = |folder: &str| -> Vec<_> {
        entries(folder).into_iter().map(|entry| (entry.episode, entry.state_hash)).collect()
    };
    assert_eq!(states("data"), states("again"));
    let origin = entries("again")[1].origin.clone().expect("an origin");
    assert_eq!((origin.demo.as_str(), origin.format.as_str()), ("demo_1", "softvt"));
    assert!(project.text("again/README.md").contains(&origin.sha256));
    let checked = check::folder(&project.path("again")).expect("a dataset");
    assert_eq!((checked.demos, checked.problems), (2, Vec::new()));
}

#[test]
fn objects_start_where_the_file_has_them() {
    let project = recorded();
    let make = |name: &str, cube: [f64; 2]| {
        let content = SyntheticFile { language: "Wait.", cube, poses: 24 };
        write(&project.path(OWN), &project.path(name), &content);
    };
    make("on.hdf5", [-0.18, 0.01]);
    make("far.hdf5", [-0.187, 0.11]);
    make("inside.hdf5", [-0.187, -0.14]);
    let run = project.run("x.lua");
    let files = ["on.hdf5", "far.hdf5", "inside.hdf5"];
    let summary = import(&run, &files, "made", ImportOptions::default()).expect("valid").expect("new");
    let told = run.told();
    assert!(told.contains("could not start") && told.contains("overlap"), "{told}");
    let task = &summary.tasks[0];
    assert_eq!((task.demos, task.attempts), (1, 3), "{task:?}");
    let rejected = [("could not start".to_owned(), 1), ("goal not reached".to_owned(), 1)];
    assert_eq!(task.rejected, rejected.into());
    let line = &project.lines("made/manifest.jsonl")[0];
    assert_eq!(line["origin"]["start"]["places"][0]["xy"], serde_json::json!([-0.18, 0.01]), "{line}");
    // All attempts can be replayed, including those that did not start.
    for attempt in 0..3 {
        assert!(project.is_reproduced("made/attempts/one", &format!("0/{attempt}")), "{attempt}");
    }
    assert!(check::folder(&project.path("made")).expect("a dataset").problems.is_empty());
    assert!(is_reproduced(&project.path("made")));
    for (language, poses, expected) in [
        ("sing", 24, "odd.hdf5: demo_0: it is of \"sing\", and x.lua has no such task"),
        ("wait", 9, "odd.hdf5: /data/demo_0/obs/eef_pose: step 9: not a unit quaternion w x y z"),
    ] {
        let content = SyntheticFile { language, cube: [-0.187, 0.012], poses };
        write(&project.path(OWN), &project.path("odd.hdf5"), &content);
        let message = import(&run, &["odd.hdf5"], "new", ImportOptions::default()).err().expect(expected);
        assert_contains(&message, expected);
    }
    let laid_out = ImportOptions { ignore_recorded_poses: true, ..ImportOptions::default() };
    import(&run, &["inside.hdf5"], "kept", laid_out).expect("the layout has it elsewhere");
}
