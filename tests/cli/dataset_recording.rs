//! `softvt record`: kept demonstrations, refused folders, and independence of threads and interruptions.

use std::{collections::BTreeMap, fs, path::Path};

use crate::support::{Project, SOLIDS};

/// A rigid cube on a shelf, or on the floor in some attempts. A push reaches the goal in the former.
const SUITE: &str = r#"
local solids = require "solids"
local layout = softvt.layout("one", function(scene)
  local beside = math.random() < 0.4
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "shelf", asset = solids.shelf, position = solids.shelf_at }
  scene:add { name = "cube", asset = solids.cube, position = beside and { 0, 0.35, 0 } or solids.cube_at }
end)
return softvt.suite { name = "one", object_type = "rigid", variation = "spatial", episodes = 1, tasks = {
  softvt.task { prompt = "wait", layout = layout, goal = softvt.on { object = "cube", target = "shelf" }, budget_steps = 30,
    expert = function(arm, scene) solids.push(arm) arm:wait(1) end },
} }
"#;

fn project() -> Project {
    Project::new(&[("x.lua", SUITE), SOLIDS])
}

/// All files below a folder by path.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(dir) = folders.pop() {
        for entry in fs::read_dir(&dir).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below it").display().to_string();
                found.insert(name, fs::read(&path).expect("read"));
            }
        }
    }
    found
}

#[test]
fn the_first_good_attempts_are_kept() {
    let project = project();
    let output = project.succeeds("record x.lua --demos 3 --out a --threads 1").out;
    let card = project.json("a/dataset.json");
    let task = &card["tasks"][0];
    let attempts = task["attempts"].as_u64().expect("a count");
    let rejected = task["rejected"]["goal not reached"].as_u64().expect("some start on the floor");
    assert_eq!((task["demos"].as_u64(), attempts), (Some(3), 3 + rejected), "{task}");
    assert!(output.contains(&format!("3 demonstrations from {attempts} attempts")), "{output}");
    let lines = project.lines("a/attempts/one/episodes.jsonl");
    assert_eq!(lines.len() as u64, attempts, "those not kept are there too");
    assert!(lines.iter().all(|line| line["split"] == "demonstration"));
    let good: Vec<_> =
        lines.iter().filter(|line| line["safety"] == true).map(|line| &line["episode"]).collect();
    let manifest = project.lines("a/manifest.jsonl");
    assert_eq!(manifest.iter().map(|line| &line["episode"]).collect::<Vec<_>>(), good);
    // With too few attempts the recording fails; with more it continues.
    let few = project.refusal("record x.lua --demos 3 --out b --threads 3 --attempts 2");
    assert!(few.contains("task 0:") && few.contains("of 3 demonstrations after 2 attempts"), "{few}");
    assert!(project.refusal("dataset check b").contains("was interrupted"));
    assert!(project.refusal("record x.lua --demos 3 --out b").contains("--resume"));
    project.succeeds("record x.lua --demos 3 --out b --threads 3 --resume");
    assert!(files(&project.path("a")) == files(&project.path("b")), "not the same bytes");
    let again = project.succeeds("record x.lua --demos 3 --out b");
    assert!(again.err.contains("already complete"), "{}", again.err);
}

#[test]
fn datasets_are_checked_and_reproduced() {
    let project = project();
    project.succeeds("record x.lua --demos 2 --out a --images video --no-privileged --gripper two-width");
    assert_eq!(project.json("a/dataset.json")["gripper"], "two-width");
    let checked = project.succeeds("dataset check a --replay 2").out;
    assert!(checked.contains("2 demonstrations,") && checked.contains("8 videos: OK"), "{checked}");
    assert_eq!(checked.matches("byte-identical, final state").count(), 2, "{checked}");
    assert!(checked.contains("2 of 2 reach the goal"), "{checked}");
    assert!(project.succeeds("replay a 0/1").out.contains("demo_1: byte-identical"));
    assert!(project.succeeds("replay a/hdf5/one_task0_demo.hdf5 0").out.contains("demo_0"));
    assert!(project.refusal("replay a 0/2").contains("no such demonstration"));
    assert!(project.succeeds("dataset stats a").out.contains("length (steps)"));
    assert!(project.text("a/stats.svg").starts_with("<svg"));
    project.write("elsewhere/note.txt", b"");
    for words in ["dataset check ../a", "replay ../a 0/1"] {
        let mut command = project.command(words);
        command.current_dir(project.path("elsewhere"));
        let output = crate::support::run_command(command);
        assert_eq!(output.code, 0, "{words}: {}", output.err);
        assert!(output.out.contains("byte-identical, final state"), "{words}: {}", output.out);
    }
    let script = project.text("x.lua");
    fs::rename(project.path("x.lua"), project.path("y.lua")).expect("renamed");
    let lost = project.refusal("dataset check a");
    assert!(lost.contains("a: its script x.lua is neither in the working folder nor in"), "{lost}");
    project.write("x.lua", script.as_bytes());
    project.write("a/videos/one_task0/demo_0_eye_in_hand_rgb.mp4", b"not a video");
    let hdf5 = project.path("a/hdf5/one_task0_demo.hdf5");
    let whole = fs::read(&hdf5).expect("read");
    fs::write(&hdf5, &whole[..whole.len() / 2]).expect("written");
    let wrong = project.refusal("dataset check a");
    for words in [
        "demo_0_eye_in_hand_rgb.mp4: eye_in_hand_rgb: not an MP4 file",
        "one_task0_demo.hdf5",
        "a: 2 problems",
    ] {
        assert!(wrong.contains(words), "{wrong}");
    }
}

#[test]
fn folders_with_other_files_are_refused() {
    let project = project();
    project.write("mine/meta/info.json", b"{}");
    let output = project.refusal("record x.lua --demos 1 --out mine --resume");
    assert!(output.contains("--out mine: the folder contains meta but no softvt recording"), "{output}");
    assert_eq!(files(&project.path("mine")).len(), 1);
    project.write("other/recording.json", b"{\"softvt\":\"0.0.1\"}");
    let output = project.refusal("record x.lua --demos 1 --out other --resume");
    assert!(output.contains("the folder contains another recording (demos: null before, 1 now)"), "{output}");
    project.write("wrong.lua", b"return nil + 1");
    assert!(project.refusal("record wrong.lua --out new").contains("wrong.lua:1"));
    let stuck = SUITE.replace("arm:wait(1)", "arm:wait(0.1) error 'lost'");
    project.write("stuck.lua", stuck.as_bytes());
    assert!(project.refusal("record stuck.lua --out new").contains("lost"));
    assert!(!project.path("new").exists(), "nothing is left of a mistake");
}

#[test]
fn the_teacher_of_a_suite_demonstrates_unless_a_policy_is_given() {
    let taught = SUITE.replace("episodes = 1,", "episodes = 1, teacher = \"tactile-servo\",");
    let project = Project::new(&[("x.lua", &taught), SOLIDS]);
    for (flag, policy) in [("", "tactile-servo"), ("--policy expert", "expert")] {
        project.succeeds(&format!("record x.lua --demos 1 {flag} --out {policy} --threads 1"));
        assert_eq!(project.json(&format!("{policy}/attempts/one/run.json"))["policy"], policy);
    }
    // An evaluation is not taught.
    project.succeeds("x.lua --out run");
    assert_eq!(project.json("run/run.json")["policy"], "expert");
    project.write("x.lua", taught.replace("tactile-servo", "noop").as_bytes());
    let message = project.refusal("record x.lua --demos 1 --out none");
    assert!(
        message.contains("suite.teacher: expected one of \"expert\", \"tactile-servo\", got \"noop\""),
        "{message}"
    );
}
