//! Imports: re-execution of foreign demonstrations, and refused files.

use std::path::{Path, PathBuf};

use rust_hdf5::H5File;
use softvt::{
    dataset::{StreamValues, TaskFile, check, manifest},
    runner::{
        PolicySource, RunError,
        import::{self, ImportOptions},
        recording::RecordingSummary,
    },
};

use crate::{
    dataset_recording::{Recording, is_reproduced},
    support::{Project, Run, SOLIDS, assert_contains, fixtures::PUSHED_CUBE},
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
    let again = || import(&run, &[OWN], "again", ImportOptions::default()).expect("valid");
    assert!(again().is_some());
    assert!(run.told().contains("one_task0_demo.hdf5: softvt, 2 demonstrations"), "{}", run.told());
    let entries = |folder: &str| manifest::read(&project.path(folder)).expect("a manifest");
    let states = |folder: &str| -> Vec<_> {
        entries(folder).into_iter().map(|entry| (entry.episode, entry.state_hash)).collect()
    };
    assert_eq!(states("data"), states("again"));
    let origin = entries("again")[1].origin.clone().expect("an origin");
    assert_eq!((origin.demo.as_str(), origin.format.as_str()), ("demo_1", "softvt"));
    assert!(project.text("again/README.md").contains(&origin.sha256));
    let checked = check::folder(&project.path("again"), check::CheckScope::Whole).expect("a dataset");
    assert_eq!((checked.demos, checked.problems), (2, Vec::new()));
    assert!(is_reproduced(&project.path("again")));
    assert!(project.is_reproduced("again/attempts/one", "0/1"));
    assert!(again().is_none(), "it is already complete");
}

#[test]
fn objects_start_where_the_file_has_them() {
    let project = recorded();
    let make = |name: &str, cube: [f64; 2]| {
        write(&project.path(OWN), &project.path(name), &SyntheticFile { language: "Wait.", cube, poses: 24 });
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
    assert!(
        check::folder(&project.path("made"), check::CheckScope::Whole)
            .expect("a dataset")
            .problems
            .is_empty()
    );
    assert!(is_reproduced(&project.path("made")));
    let laid_out = ImportOptions { ignore_recorded_poses: true, ..ImportOptions::default() };
    import(&run, &["inside.hdf5"], "kept", laid_out).expect("the layout has it elsewhere");
}

#[test]
fn invalid_imports_are_refused_and_write_nothing() {
    let project = recorded();
    let make = |name: &str, language: &str, poses: usize| {
        let content = SyntheticFile { language, cube: [-0.187, 0.012], poses };
        write(&project.path(OWN), &project.path(name), &content);
    };
    make("odd.hdf5", "sing", 24);
    make("torn.hdf5", "wait", 9);
    project.write("short.hdf5", &std::fs::read(project.path(OWN)).expect("read")[..900]);
    project.write("mine/notes.txt", b"mine");
    project.write(
        "two.lua",
        PUSHED_CUBE.replace("name = \"one\", object_type", "name = \"two\", object_type").as_bytes(),
    );
    project.write("world.lua", b"return softvt.experiment { name = 'e', grid = { a = { 1 } }, run = function() return { b = 1 } end }");
    let task = |word: &str| {
        let task = word.to_owned();
        project.run("x.lua").with(|config| config.tasks = vec![task])
    };
    let x = || project.run("x.lua");
    for (run, files, expected) in [
        (x(), &["short.hdf5"][..], "short.hdf5 is cut short: it has 900 of"),
        (x(), &["none.hdf5"], "cannot read none.hdf5"),
        (x(), &["x.lua"], "x.lua is not an HDF5 file"),
        (x(), &["odd.hdf5"], "odd.hdf5: demo_0: it is of \"sing\", and x.lua has no such task"),
        (x(), &["torn.hdf5"], "torn.hdf5: /data/demo_0/obs/eef_pose: step 9: not a unit quaternion w x y z"),
        (task("7"), &["odd.hdf5"], "tasks 7: suite one has no such task"),
        (task("wait"), &["odd.hdf5"], "tasks wait: matches 2 tasks; select the one of the demonstrations"),
        (
            x().seed(3),
            &[OWN],
            "it was recorded with the seed 0, and this import uses the seed 3; import it with the seed 0",
        ),
        (
            project.run("two.lua").with(|config| config.tasks = vec!["0".into()]),
            &[OWN],
            "it is of \"wait\" of the suite one, and two.lua has no such task; softvt imports its own recordings into their own task",
        ),
        (project.run("world.lua"), &[OWN], "expected a suite or a list of suites"),
        (x(), &[OWN, OWN], "are byte-identical"),
    ] {
        let message = import(&run, files, "new", ImportOptions::default()).err().expect(expected);
        assert_contains(&message, expected);
        assert!(!project.path("new").exists(), "{expected}");
    }
    for (out, expected) in [
        ("mine", "the folder contains notes.txt but no softvt recording"),
        ("data", "out data: the folder contains recorded demonstrations"),
        ("x.lua", "out x.lua: not a folder"),
    ] {
        assert_contains(import(&x(), &[OWN], out, ImportOptions::default()).err().expect(expected), expected);
    }
    for data in ["data", OWN] {
        let message =
            project.path(data).display().to_string().parse::<PolicySource>().expect_err("no policy");
        assert_contains(&message, "is a dataset, not a policy");
    }
}
