//! `softvt dataset import`: re-execution of foreign demonstrations, and refused files.

use std::path::Path;

use rust_hdf5::H5File;
use softvt::dataset::{StreamValues, TaskFile};

use crate::support::{Project, SOLIDS};

/// A rigid cube on a shelf. A push reaches the goal.
const SUITE: &str = r#"
local solids = require "solids"
local layout = softvt.layout("one", function(scene)
  local x, y, z = table.unpack(solids.cube_at)
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "shelf", asset = solids.shelf, position = solids.shelf_at }
  scene:add { name = "cube", asset = solids.cube, position = { x + 0.005 * math.random(), y, z } }
  scene:add { name = "other", asset = solids.cube, position = { x, -0.15, z } }
end)
local function task(prompt)
  return softvt.task { prompt = prompt, layout = layout, goal = softvt.on { object = "cube", target = "shelf" }, budget_steps = 30,
    expert = function(arm, scene) solids.push(arm) arm:wait(1) end }
end
return softvt.suite { name = "one", object_type = "rigid", variation = "spatial", episodes = 1,
  tasks = { task "wait", task "wait longer" } }
"#;

/// A project with a dataset of two demonstrations of task 0.
fn recorded() -> Project {
    let project = Project::new(&[("x.lua", SUITE), SOLIDS]);
    project.succeeds("record x.lua --task 0 --demos 2 --out data --images video --no-privileged");
    project
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
    let output = project.succeeds(&format!("dataset import x.lua {OWN} --out again --images video"));
    assert!(output.err.contains("one_task0_demo.hdf5: softvt, 2 demonstrations"), "{}", output.err);
    let states = |folder: &str| -> Vec<_> {
        let lines = project.lines(&format!("{folder}/manifest.jsonl"));
        lines.iter().map(|line| (line["episode"].clone(), line["state_hash"].clone())).collect()
    };
    assert_eq!(states("data"), states("again"));
    let origin = &project.lines("again/manifest.jsonl")[1]["origin"];
    assert_eq!((&origin["demo"], &origin["format"]), (&"demo_1".into(), &"softvt".into()), "{origin}");
    assert!(project.text("again/README.md").contains(origin["sha256"].as_str().expect("a hash")));
    let checked = project.succeeds("dataset check again --replay all").out;
    assert!(checked.contains("2 of 2 byte-identical, 2 of 2 reach the goal"), "{checked}");
    assert!(project.succeeds("replay again/attempts/one 0/1").out.contains("byte-identical"));
    let once_more = project.succeeds(&format!("dataset import x.lua {OWN} --out again --images video"));
    assert!(once_more.err.contains("is already complete"), "{}", once_more.err);
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
    let words = "dataset import x.lua on.hdf5 far.hdf5 inside.hdf5 --out made --images video";
    let output = project.succeeds(words);
    assert!(output.err.contains("could not start") && output.err.contains("overlap"), "{}", output.err);
    let task = &project.json("made/dataset.json")["tasks"][0];
    assert_eq!((&task["demos"], &task["attempts"]), (&1.into(), &3.into()), "{task}");
    assert_eq!(
        task["rejected"],
        serde_json::json!({ "goal not reached": 1, "could not start": 1 }),
        "{task}"
    );
    let line = &project.lines("made/manifest.jsonl")[0];
    assert_eq!(line["origin"]["start"]["places"][0]["xy"], serde_json::json!([-0.18, 0.01]), "{line}");
    // All attempts can be replayed, including those that did not start.
    for attempt in 0..3 {
        let again = project.succeeds(&format!("replay made/attempts/one 0/{attempt}"));
        assert!(again.out.contains("byte-identical"), "{}", again.out);
    }
    project.succeeds("dataset check made");
    project.succeeds("dataset import x.lua inside.hdf5 --out kept --images video --layout");
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
        SUITE.replace("name = \"one\", object_type", "name = \"two\", object_type").as_bytes(),
    );
    project.write("world.lua", b"return softvt.experiment { name = 'e', grid = { a = { 1 } }, run = function() return { b = 1 } end }");
    for (words, expected) in [
        ("x.lua short.hdf5", "short.hdf5 is cut short: it has 900 of"),
        ("x.lua none.hdf5", "cannot read none.hdf5"),
        ("x.lua x.lua", "x.lua is not an HDF5 file"),
        ("x.lua odd.hdf5", "odd.hdf5: demo_0: it is of \"sing\", and x.lua has no such task"),
        ("x.lua torn.hdf5", "torn.hdf5: /data/demo_0/obs/eef_pose: step 9: not a unit quaternion w x y z"),
        ("x.lua odd.hdf5 --task 7", "--task 7: suite one has no such task"),
        ("x.lua odd.hdf5 --task wait", "--task wait: matches 2 tasks; select the one of the demonstrations"),
        (
            "x.lua OWN --seed 3",
            "it was recorded with the seed 0, and this import uses the seed 3; add --seed 0",
        ),
        ("two.lua OWN", "it is of \"wait\" of the suite one, and two.lua has no such task"),
        ("world.lua OWN", "softvt dataset import needs a suite"),
        ("x.lua OWN OWN", "are byte-identical"),
    ] {
        let words = words.replace("OWN", OWN);
        let output = project.refusal(&format!("dataset import {words} --out new"));
        assert!(output.contains(expected), "{words}: {output}");
        assert!(!project.path("new").exists(), "{words}");
    }
    let output = project.refusal(&format!("dataset import x.lua {OWN} --out mine"));
    assert!(output.contains("the folder contains notes.txt but no softvt recording"), "{output}");
    let output = project.refusal(&format!("dataset import x.lua {OWN} --out data"));
    assert!(output.contains("--out data: the folder contains a dataset of softvt record"), "{output}");
    let output = project.refusal(&format!("dataset import x.lua {OWN} --out x.lua"));
    assert!(output.contains("--out x.lua: not a folder"), "{output}");
    for data in ["data", OWN] {
        let output = project.refusal(&format!("x.lua --policy {data} --out run"));
        assert!(
            output.contains("is a dataset, not a policy") && output.contains("softvt dataset check"),
            "{output}"
        );
    }
}
