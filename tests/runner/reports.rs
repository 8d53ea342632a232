//! Comparisons, pages and tables of finished runs, and runs that cannot be read.

use std::{fs, path::Path};

use serde_json::{Value, json};
use softvt::{
    report::{comparison_table, styled_text::TerminalFormat},
    runner::TraceDetail,
    runs::record_line::{read_line, write_line},
};

use crate::support::{Project, Run, Small, assert_contains};

/// Two short runs of the same two episodes.
fn project() -> Project {
    let project = Small { task: "budget_steps = 8", ..Small::default() }.project();
    for (policy, out) in [("noop", "runs/a"), ("random", "runs/b")] {
        project.run("x.lua").episodes(2).policy(policy).out(out).finish();
    }
    project
}

/// One of two shards of two episodes of a project.
fn part(project: &Project, number: u32) -> Run<'_> {
    let run = project.run("x.lua").episodes(2).shard(&format!("{number}/2"));
    run.out(&format!("part_{number}"))
}

/// Changes a JSON file of a project.
fn edit(project: &Project, path: &str, change: impl Fn(&mut Value)) {
    let mut document = project.json(path);
    change(&mut document);
    project.write(path, document.to_string().as_bytes());
}

#[test]
fn damaged_folders_of_a_run_are_named() {
    let project = project();
    let torn = project.text("runs/a/episodes.jsonl");
    for (dir, path, text) in [
        ("json", "run.json", "{\"softvt\": ".to_owned()),
        ("fields", "run.json", json!({ "softvt": env!("CARGO_PKG_VERSION"), "script": "x.lua" }).to_string()),
        ("line", "episodes.jsonl", format!("{}\n{torn}", &torn[..50])),
        ("none", "episodes.jsonl", String::new()),
    ] {
        for name in ["run.json", "episodes.jsonl"] {
            project.write(&format!("bad/{dir}/{name}"), project.text(&format!("runs/a/{name}")).as_bytes());
        }
        project.write(&format!("bad/{dir}/{path}"), text.as_bytes());
    }
    fs::remove_file(project.path("bad/none/episodes.jsonl")).expect("removed");
    for (dir, words) in [
        ("bad/json", "bad/json/run.json is not a valid run file: EOF while parsing"),
        ("bad/fields", "bad/fields/run.json is not a valid run file: missing field `suite`"),
        ("bad/line", "bad/line/episodes.jsonl:1: not an episode record"),
        ("bad/none", "cannot read bad/none/episodes.jsonl"),
    ] {
        let message = project.message(project.stored(dir));
        assert!(message.starts_with(words), "{dir}: {message}");
        assert!(!message.contains("this is softvt"), "no other version: {message}");
    }
}

#[test]
fn runs_of_other_versions_are_reported() {
    let project = project();
    edit(&project, "runs/a/run.json", |run| run["softvt"] = json!("0.0.1"));
    let report = project.report(&["runs/a"]);
    let warning = "runs/a was written by softvt 0.0.1, and this is softvt";
    assert!(report.warnings[0].starts_with(warning), "{:?}", report.warnings);
    assert!(report.html.contains("runs/a was written by softvt 0.0.1"));
    let text = comparison_table::table(
        &project.compare("runs/a", "runs/b").expect("comparable"),
        TerminalFormat::PLAIN.with_details(),
    );
    assert_contains(&text, "the runs also differ in softvt (run.json)");
    // Lines without a digest, and another manifest, as earlier versions wrote them.
    let refusal = || project.message(project.stored("runs/a"));
    let written = "was written by softvt 0.0.1 in another format: read it with that version";
    let lines = project.lines("runs/a/episodes.jsonl").into_iter().map(|mut line| {
        line.as_object_mut().and_then(|record| record.shift_remove("record_sha256"));
        line.to_string() + "\n"
    });
    project.write("runs/a/episodes.jsonl", lines.collect::<String>().as_bytes());
    assert_eq!(refusal(), format!("runs/a/episodes.jsonl {written}"));
    edit(&project, "runs/a/run.json", |run| run["tasks"] = json!("all"));
    assert_eq!(refusal(), format!("runs/a/run.json {written}"));
}

#[test]
fn unfinished_runs_can_be_reported() {
    let project = project();
    let lines = project.text("runs/a/episodes.jsonl");
    // The second line is incomplete, as after a crash; there is no summary yet.
    let whole = lines.find('\n').expect("a line") + 1;
    project.write("runs/a/episodes.jsonl", &lines.as_bytes()[..whole + 40]);
    fs::remove_file(project.path("runs/a/summary.json")).expect("removed");
    let warning = "runs/a is not finished: it has 1 of 2 episodes";
    let report = project.report(&["runs/a", "runs/b"]);
    let warnings = report.warnings.join("\n");
    let torn = "the last line of runs/a/episodes.jsonl is truncated";
    assert!(warnings.contains(warning) && warnings.contains(torn), "{warnings}");
    assert!(report.html.contains(torn) && report.markdown.contains("| noop | 1 of 2 |"));
    let compared = project.compare("runs/a", "runs/b").expect("comparable");
    assert_eq!((compared.all.pairs, compared.unpaired), (1, 1));
    let text = project.relative(comparison_table::table(&compared, TerminalFormat::PLAIN.with_details()));
    assert!(text.contains("1 paired episode") && text.contains(warning), "{text}");
    assert_contains(&text, "1 episode present in only one run was skipped");
    project.write("runs/a/episodes.jsonl", b"");
    assert_eq!(project.message(project.compare("runs/a", "runs/b")), "runs/a has no episode yet");
    project.report(&["runs/a"]);
}

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

#[test]
fn edited_lines_are_refused_by_name() {
    let project = Small { task: "budget_steps = 8", ..Small::default() }.project();
    (1..=2).for_each(|number| drop(part(&project, number).finish()));
    let (lines, manifest) = (project.text("part_1/episodes.jsonl"), project.text("part_1/run.json"));
    let merged = || project.message(project.merge("all", &["part_1", "part_2"]));
    let changed = lines.replacen(r#""goal":false"#, r#""goal":true"#, 1);
    assert_ne!(changed, lines);
    project.write("part_1/episodes.jsonl", changed.as_bytes());
    for refused in [
        project.message(project.stored("part_1")),
        project.message(project.compare("part_2", "part_1")),
        merged(),
        project.message(project.replay("part_1", "0/0", None)),
        part(&project, 1).resume().error(),
    ] {
        let problem = "part_1/episodes.jsonl:1: its SHA-256 is not the record_sha256 at its end";
        assert!(refused.contains(problem), "{refused}");
    }
    project.write("part_1/episodes.jsonl", lines.as_bytes());
    project.write("part_1/run.json", manifest.replace(r#""1/2""#, r#""99/2""#).as_bytes());
    let refused = merged();
    assert!(
        refused.contains("part_1/run.json") && refused.contains("expected I/N with I in 1..N"),
        "{refused}"
    );
    // A merge that fails while it writes leaves nothing.
    project.write("part_1/run.json", manifest.as_bytes());
    project.write("part_1/softvtbench/thresholds.json", b"{");
    merged();
    assert!(!project.path("all.part").exists() && !project.path("all").exists());
}

#[test]
fn merged_shards_are_byte_identical_to_one_run() {
    let project = Small { task: "budget_steps = 8", ..Small::default() }.project();
    for (is_twin, name) in [(false, "soft"), (true, "rigid")] {
        let run = || {
            let run = project.run("x.lua").episodes(3);
            if is_twin { run.twin() } else { run }
        };
        let parts = [1, 2].map(|number| format!("{name}_{number}"));
        run().out(name).finish();
        for (part, shard) in parts.iter().zip(["1/2", "2/2"]) {
            run().shard(shard).out(part).finish();
        }
        let parts = parts.each_ref().map(String::as_str);
        project.merge(&format!("{name}_all"), &parts).expect("merged");
        for file in ["run.json", "episodes.jsonl", "summary.json", "softvtbench/summary.json"] {
            let [merged, whole] = ["_all", ""].map(|end| project.text(&format!("{name}{end}/{file}")));
            assert_eq!(merged, whole, "{name} {file}");
        }
        let summary = project.json(&format!("{name}_all/summary.json"));
        assert_eq!((&summary["episodes"], &summary["privileged"]), (&3.into(), &true.into()));
    }
}

#[test]
fn damaged_actions_are_found_by_merge_and_restored_by_resume() {
    let project = Small { task: "budget_steps = 8", expert: "arm:close_to(1)", ..Small::default() }.project();
    (1..=2).for_each(|number| drop(part(&project, number).finish()));
    let merged = || project.message(project.merge("all", &["part_1", "part_2"]));
    let path = "part_1/actions/task_000/episode_00000.npy";
    let whole = fs::read(project.path(path)).expect("written");
    let mut changed = whole.clone();
    let last = changed.len() - 1;
    changed[last] ^= 1;
    for (bytes, problem) in
        [(&changed[..], "its SHA-256 differs"), (&whole[..whole.len() - 56], "do not fill the shape")]
    {
        project.write(path, bytes);
        let refused = merged();
        assert!(refused.starts_with(path) && refused.contains(problem), "{refused}");
        let messages = part(&project, 1).resume().finish().messages;
        assert!(messages.contains(path) && messages.contains(problem), "{messages}");
        assert!(fs::read(project.path(path)).expect("restored") == whole);
    }
    fs::remove_file(project.path(path)).expect("removed");
    assert!(merged().contains(path));
    fs::remove_file(project.path("part_1/run.json")).expect("removed");
    assert_contains(part(&project, 1).resume().error(), "cannot read part_1/run.json");
    let lines = project.text("part_2/episodes.jsonl");
    project.write("part_2/episodes.jsonl", lines.repeat(2).as_bytes());
    let message = project.message(project.stored("part_2"));
    assert!(message.starts_with("part_2/episodes.jsonl:2: task 0 episode 1 occurs twice"), "{message}");
}
