//! `softvt record` and `softvt dataset`: what they print, and datasets that are read from other folders.

use std::fs;

use crate::support::{Project, SOLIDS, fixtures::MISPLACED_CUBE, run_command};

fn project() -> Project {
    Project::new(&[("x.lua", MISPLACED_CUBE), SOLIDS])
}

#[test]
fn recordings_are_printed_checked_and_reproduced() {
    let project = project();
    let few = project.refusal("record x.lua --demos 2 --out a --images video --no-privileged --attempts 1");
    assert!(few.contains("of 2 demonstrations after 1 attempt"), "{few}");
    assert!(project.refusal("dataset check a").contains("was interrupted"));
    let line = "record x.lua --demos 2 --out a --images video --no-privileged";
    assert!(project.refusal(line).contains("continue with --resume --out a"));
    let output = project.succeeds(&format!("{line} --resume")).out;
    let attempts = project.json("a/dataset.json")["tasks"][0]["attempts"].as_u64().expect("a count");
    assert!(output.contains(&format!("2 demonstrations from {attempts} attempts")), "{output}");
    let again = project.succeeds(line);
    assert!(again.err.contains("already complete"), "{}", again.err);
    let checked = project.succeeds("dataset check a --replay 2").out;
    assert!(checked.contains("2 demonstrations,") && checked.contains("8 videos: OK"), "{checked}");
    assert_eq!(checked.matches("byte-identical, final state").count(), 2, "{checked}");
    assert!(checked.contains("2 of 2 reach the goal"), "{checked}");
    assert!(project.succeeds("replay a 0/1").out.contains("demo_1: byte-identical"));
    assert!(project.succeeds("replay a/hdf5/one_task0_demo.hdf5 0").out.contains("demo_0"));
    assert!(project.refusal("replay a 0/2").contains("no such demonstration"));
    assert!(project.succeeds("dataset stats a").out.contains("length (steps)"));
    assert!(project.text("a/stats.svg").starts_with("<svg"));
    project.succeeds("dataset stats a --out a/stats.svg");
    let manifest = project.text("a/manifest.jsonl");
    for (out, words) in [
        ("a/manifest.jsonl", "--out a/manifest.jsonl: give a file that ends in .svg"),
        ("a/kept.svg", "--out a/kept.svg: it exists and is no SVG file; give another name"),
    ] {
        project.write("a/kept.svg", b"not a plot");
        assert_eq!(project.refusal(&format!("dataset stats a --out {out}")), words);
    }
    assert_eq!(project.text("a/manifest.jsonl"), manifest);
    assert_eq!(project.text("a/kept.svg"), "not a plot");
    project.write("elsewhere/note.txt", b"");
    for words in ["dataset check ../a", "replay ../a 0/1"] {
        let mut command = project.command(words);
        command.current_dir(project.path("elsewhere"));
        let output = run_command(command);
        assert_eq!(output.code, 0, "{words}: {}", output.err);
        assert!(output.out.contains("byte-identical, final state"), "{words}: {}", output.out);
    }
    let script = project.text("x.lua");
    fs::rename(project.path("x.lua"), project.path("y.lua")).expect("renamed");
    let lost = project.refusal("dataset check a");
    assert!(lost.contains("a: its script x.lua is not in the working folder or in"), "{lost}");
    project.write("x.lua", script.as_bytes());
    project.write("a/videos/one_task0/demo_0_eye_in_hand_rgb.mp4", b"not a video");
    let wrong = project.refusal("dataset check a");
    assert!(wrong.contains("eye_in_hand_rgb: not an MP4 file") && wrong.ends_with("a: 1 problem"), "{wrong}");
}

#[test]
fn the_grip_code_of_exports_is_recorded() {
    let project = project();
    let words = "--demos 1 --images video --no-privileged --gripper two-width";
    project.succeeds(&format!("record x.lua {words} --out a"));
    assert_eq!(project.json("a/dataset.json")["gripper"], "two-width");
    // The flag takes the place of the suite's teacher.
    let taught = MISPLACED_CUBE.replace("episodes = 1,", "episodes = 1, teacher = \"tactile-servo\",");
    project.write("x.lua", taught.as_bytes());
    project.succeeds("record x.lua --demos 1 --images video --policy expert --out expert");
    assert_eq!(project.json("expert/attempts/one/run.json")["policy"], "expert");
}
