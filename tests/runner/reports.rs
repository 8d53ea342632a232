//! Files of finished runs that are lost.

use std::{fs, path::Path};

use softvt::{
    runner::TraceDetail,
    runs::record_line::{read_line, write_line},
};

use crate::support::{Run, Small, assert_contains};

#[test]
fn lost_files_are_restored_byte_identically() {
    let project = Small { task: "budget_steps = 8", expert: "arm:close_to(1)", ..Small::default() }.project();
    let run = || project.run("x.lua").episodes(3).trace(TraceDetail::State).out("run");
    let told = |run: Run| run.finish().messages;
    told(run());
    let files = [
        "actions/task_000/episode_00000.npy",
        "softvtbench/task_000/episode_00001/policy_action_debug.jsonl",
        "trace/task_000/episode_00002.jsonl",
        "softvtbench/episodes.csv",
        "softvtbench/thresholds.json",
        "summary.json",
        "episodes.jsonl",
    ];
    let bytes = |file: &str| fs::read(project.path(&format!("run/{file}"))).unwrap_or_default();
    let before = files.map(bytes);
    files[..5]
        .iter()
        .for_each(|file| fs::remove_file(project.path(&format!("run/{file}"))).expect("removed"));
    let messages = told(run());
    let expected = "restoring files of 3 finished episodes (first: run/actions/task_000/episode_00000.npy)";
    assert_contains(&messages, expected);
    assert!(files.map(bytes) == before);
    assert!(told(run()).contains("already complete"));
    // Without its summary the folder is unfinished and can be resumed.
    fs::remove_file(project.path("run/summary.json")).expect("removed");
    told(run().resume());
    assert!(files.map(bytes) == before);
    // Videos can be added later.
    told(run().with(|config| config.video = Some("1".parse().expect("an episode"))));
    let drawn =
        |e: u32, kind: &str| project.path(&format!("run/video/task_000/episode_0000{e}.{kind}")).exists();
    assert!(drawn(1, "mp4") && drawn(1, "png") && !drawn(0, "mp4"));
    assert!(files.map(bytes) == before);
    // So can the positions of nodes. A trace that has them stays.
    told(project.run("x.lua").episodes(3).trace(TraceDetail::Nodes).out("run"));
    let with_nodes =
        |e: u32| project.text(&format!("run/trace/task_000/episode_0000{e}.jsonl")).contains("\"nodes\":");
    assert!((0..3).all(with_nodes));
    assert!(told(run()).contains("already complete") && (0..3).all(with_nodes));
    // A simulation that differs from its record is reported, and its files are not restored.
    let lines: String = project
        .text("run/episodes.jsonl")
        .lines()
        .map(|line| {
            let mut record = read_line(line.as_bytes()).expect("a record");
            record.stats.state_hash.insert(0, 'f');
            write_line(Path::new("episodes.jsonl"), &record).expect("JSON")
        })
        .collect();
    project.write("run/episodes.jsonl", lines.as_bytes());
    fs::remove_file(project.path("run/actions/task_000/episode_00000.npy")).expect("removed");
    let messages = told(run());
    assert!(messages.contains("the simulation differs from its record (state_hash:"), "{messages}");
    assert!(!project.path("run/actions/task_000/episode_00000.npy").exists());
    assert_eq!(project.text("run/episodes.jsonl"), lines);
}
